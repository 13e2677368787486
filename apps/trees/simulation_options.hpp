/// \file
/// Options of `llmt discover` about the simulation: its parameters, and a command in place of a table.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "trees/command_simulation.hpp"
#include "trees/parameter_table.hpp"

namespace llmt::apps {

struct SimulationArguments {
  std::string parameters;                   ///< file of derivatives, or empty
  std::vector<std::string> nominal_values;  ///< texts of parse_parameter()
  std::string command;                      ///< or empty
  double seconds = 60.0;                    ///< of a run of the command
  std::string apply;                        ///< file of what was found, or empty
  bool parameters_are_set = false;
  std::string code;  ///< file to write, or empty
};

void add_simulation_options(CLI::App& command, SimulationArguments& arguments);

/// Throws std::invalid_argument for options that do not go together.
void check(const SimulationArguments& arguments);

/// The command with its parameters.
CommandSimulation command_simulation(const SimulationArguments& arguments, const std::vector<std::string>& inputs,
                                     const std::vector<std::string>& outputs);

}  // namespace llmt::apps
