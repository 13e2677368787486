/// \file
/// The subcommands of the program llmt-robot. Each adds itself to the program and runs when it is called.
#pragma once

#include <CLI/CLI.hpp>

namespace llmt::apps {

void add_paper(CLI::App& app);
void add_simulate(CLI::App& app);
void add_calibrate(CLI::App& app);
void add_discover(CLI::App& app);

}  // namespace llmt::apps
