// study: what members of the family and their options bring, as tables of test errors, leaves and seconds.
#include "program.hpp"
#include "study/study.hpp"

int main(int argc, char** argv) {
  return bench::run_program("study", "Tables of test errors, leaves and seconds", argc, argv, bench::add_codes,
                            bench::add_far, bench::add_members, bench::add_missing, bench::add_modes,
                            bench::add_monotone, bench::add_odes, bench::add_poses, bench::add_pruning,
                            bench::add_readings, bench::add_repeats, bench::add_sets, bench::add_srbench,
                            bench::add_systems);
}
