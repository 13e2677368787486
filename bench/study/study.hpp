/// \file
/// The subcommands of the program `study`. Each prints one table; numbers do not depend on the number of threads.
#pragma once

#include <CLI/CLI.hpp>

#include "study/tasks.hpp"

namespace bench {

/// Adds [TASK...], --data FOLDER and --trials N.
void add_task_options(CLI::App& command, TaskChoice& choice);

void add_codes(CLI::App& study);
void add_far(CLI::App& study);
void add_members(CLI::App& study);
void add_missing(CLI::App& study);
void add_modes(CLI::App& study);
void add_monotone(CLI::App& study);
void add_odes(CLI::App& study);
void add_poses(CLI::App& study);
void add_pruning(CLI::App& study);
void add_readings(CLI::App& study);
void add_repeats(CLI::App& study);
void add_sets(CLI::App& study);
void add_srbench(CLI::App& study);
void add_systems(CLI::App& study);

}  // namespace bench
