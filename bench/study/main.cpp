// study: what members of the family and their options bring, as tables of test errors, leaves and seconds.
#include "study/study.hpp"

#include <fmt/format.h>

namespace bench {

void add_task_options(CLI::App& command, TaskChoice& choice) {
  command.add_option("tasks", choice.names, "names of known truths, or of data sets with --data; default: all");
  command.add_option("--data", choice.folder, "folder with NAME.csv and NAME.splits.csv")
      ->check(CLI::ExistingDirectory);
  command.add_option("--trials", choice.trials, "largest number of seeds or splits of a task")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

}  // namespace bench

int main(int argc, char** argv) {
  CLI::App study("Tables of test errors, leaves and seconds", "study");
  study.require_subcommand(1);
  study.set_help_all_flag("--help-all", "help of all subcommands");
  bench::add_members(study);
  bench::add_modes(study);
  bench::add_monotone(study);
  bench::add_pruning(study);
  bench::add_sets(study);
  try {
    CLI11_PARSE(study, argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "study: {}\n", error.what());
    return 1;
  }
  return 0;
}
