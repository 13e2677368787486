#include "trees/simulation_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "shared/options.hpp"

namespace llmt::apps {

void add_simulation_options(CLI::App& command, SimulationArguments& arguments) {
  add_input_file(command, "--parameters", arguments.parameters,
                 "Derivatives of the targets by parameters of the simulation, row by row (CSV): columns "
                 "TARGET:PARAMETER, or PARAMETER for one target. Parameters are fitted with what is found");
  command
      .add_option("--parameter", arguments.nominal_values,
                  "Nominal value and unit of a parameter, for each once: mass=3.0[kg]")
      ->type_name("NAME=VALUE[UNIT]")
      ->allow_extra_args(false);
  command
      .add_option(
          "--simulate", arguments.command,
          "The simulation as a command in place of the file SIMULATED: it reads inputs and parameters (CSV) and "
          "writes the targets (CSV)")
      ->type_name("COMMAND");
  add_number(command, "--simulate-seconds", arguments.seconds, above_zero, "Longest time of a run of the command")
      ->capture_default_str();
  add_input_file(command, "--apply", arguments.apply,
                 "Add what was found, a file of --json, to the simulated targets of other rows, the file SIMULATED; "
                 "with the file MEASURED, the gap is printed");
  command.add_flag("--parameters-are-set", arguments.parameters_are_set,
                   "With --apply: the targets were simulated with the new values of the parameters");
  add_output_file(command, "--code", arguments.code,
                  "What was found as a function in C or Python to write, by the extension .c or .py");
}

void check(const SimulationArguments& arguments) {
  const auto refuse = [](const char* reason) { throw std::invalid_argument(reason); };
  if (!arguments.apply.empty() && (!arguments.command.empty() || !arguments.nominal_values.empty())) {
    refuse("--apply excludes --simulate and --parameter: the values are those that were found");
  }
  if (!arguments.command.empty() && !arguments.parameters.empty()) {
    refuse("--simulate and --parameters exclude each other: the command gives the derivatives");
  }
  if (!arguments.command.empty() && arguments.nominal_values.empty()) {
    refuse("--simulate needs the parameters that it may adjust, --parameter NAME=VALUE[UNIT] for each");
  }
  if (!arguments.nominal_values.empty() && arguments.command.empty() && arguments.parameters.empty()) {
    refuse("--parameter needs --parameters FILE or --simulate COMMAND");
  }
  if (arguments.parameters_are_set && arguments.apply.empty()) refuse("--parameters-are-set needs --apply");
}

CommandSimulation command_simulation(const SimulationArguments& arguments, const std::vector<std::string>& inputs,
                                     const std::vector<std::string>& outputs) {
  CommandSimulation simulation{.command = arguments.command,
                               .seconds = arguments.seconds,
                               .parameters = parse_parameters(arguments.nominal_values),
                               .inputs = inputs,
                               .outputs = outputs};
  for (const discovery::Parameter& parameter : simulation.parameters) {
    if (std::ranges::find(inputs, parameter.name) != inputs.end()) {
      throw std::invalid_argument(fmt::format("--parameter: \"{}\" is an input too", parameter.name));
    }
  }
  return simulation;
}

}  // namespace llmt::apps
