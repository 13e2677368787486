/// \file
/// The subcommands of the program `scaling`.
#pragma once

#include <CLI/CLI.hpp>

namespace bench {

void add_fits(CLI::App& program);
void add_roofline(CLI::App& program);

}  // namespace bench
