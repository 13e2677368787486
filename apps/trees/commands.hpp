/// \file
/// The subcommands of the program llmt. Each adds itself to the program and runs when it is called.
#pragma once

#include <CLI/CLI.hpp>

namespace llmt::apps {

/// What predict and explain say of arguments that were exchanged.
inline constexpr const char* model_comes_first = "the model (JSON) comes first, then the table (CSV)";

void add_fit(CLI::App& app);
void add_predict(CLI::App& app);
void add_simulate(CLI::App& app);
void add_inspect(CLI::App& app);
void add_explain(CLI::App& app);
void add_check(CLI::App& app);
void add_compare(CLI::App& app);
void add_discover(CLI::App& app);
void add_signals(CLI::App& app);
void add_table(CLI::App& app);
void add_export(CLI::App& app);

}  // namespace llmt::apps
