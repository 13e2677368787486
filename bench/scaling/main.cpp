// scaling: how time and memory of a fit grow, and what the machine can do at most.
#include "scaling/scaling.hpp"

#include <fmt/format.h>

int main(int argc, char** argv) {
  CLI::App program("Time and memory of whole fits, and the peak of the machine", "scaling");
  program.require_subcommand(1);
  program.set_help_all_flag("--help-all", "help of all subcommands");
  bench::add_fits(program);
  bench::add_roofline(program);
  try {
    CLI11_PARSE(program, argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "scaling: {}\n", error.what());
    return 1;
  }
  return 0;
}
