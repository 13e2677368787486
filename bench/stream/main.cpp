// stream: what llmt::Stream learns, how fast it follows a change, and what it costs.
#include <fmt/format.h>

#include "stream/stream.hpp"

int main(int argc, char** argv) {
  CLI::App program("What streams learn and cost", "stream");
  program.require_subcommand(1);
  program.set_help_all_flag("--help-all", "help of all subcommands");
  bench::add_alarms(program);
  bench::add_drift(program);
  bench::add_scaling(program);
  bench::add_sets(program);
  bench::add_spread(program);
  try {
    CLI11_PARSE(program, argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "stream: {}\n", error.what());
    return 1;
  }
  return 0;
}
