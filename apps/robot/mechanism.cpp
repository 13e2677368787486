#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/mechanism/mechanism_calibration.hpp"
#include "llmt/robotics/mechanism/mechanism_file.hpp"
#include "report/robot/mechanism_report.hpp"
#include "robot/commands.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

struct MechanismArguments {
  std::string mechanism;
  std::string data;
  std::string output;
  std::string errors;
  bool solve = false;
  Eigen::Index simulate = 0;
  std::vector<std::string> measure;
  std::vector<std::string> noise;
  int folds = 5;
  std::uint64_t seed = 1;
  DecimalMark mark = DecimalMark::point;
  bool robust = false;
  bool json = false;
};

// A description whose start values are near no configuration is named itself, before the readings are.
robotics::Mechanism read_description(const std::string& path) {
  robotics::Mechanism mechanism = robotics::read_mechanism(path);
  try {
    robotics::assemble(mechanism, Eigen::MatrixXd(0, std::ssize(mechanism.coordinates)));
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
  return mechanism;
}

void put(const MechanismArguments& arguments, const std::string& csv) {
  const std::string text = with_decimal_mark(csv, arguments.mark);
  if (arguments.output.empty()) {
    print_bytes(text);
  } else {
    write_file(arguments.output, text);
  }
}

std::vector<std::string> all_names(const robotics::Mechanism& mechanism) {
  std::vector<std::string> names;
  for (const robotics::Coordinate& coordinate : mechanism.coordinates) names.push_back(coordinate.name);
  return names;
}

// "x=0.01": the standard deviation of a coordinate's readings in its unit. Without it that of the description.
Eigen::VectorXd noise_of_readings(const robotics::Mechanism& mechanism, const std::vector<std::string>& texts) {
  Eigen::VectorXd noise(std::ssize(mechanism.coordinates));
  for (Eigen::Index i = 0; i < noise.size(); ++i) noise(i) = mechanism.coordinates[i].sigma.value_or(0.0);
  for (const std::string& text : texts) {
    const std::size_t sign = std::min(text.find('='), text.size());
    const auto found = std::ranges::find(mechanism.coordinates, text.substr(0, sign), &robotics::Coordinate::name);
    if (sign == text.size() || found == mechanism.coordinates.end()) {
      throw std::invalid_argument(fmt::format("--noise {}: must be NAME=NUMBER, with NAME one of {}", text,
                                              fmt::join(all_names(mechanism), ", ")));
    }
    noise(found - mechanism.coordinates.begin()) = read_number("--noise", text.substr(sign + 1), not_negative);
  }
  return noise;
}

// Errors name the description: there is no other file.
Eigen::MatrixXd poses_within_limits(const MechanismArguments& arguments, const robotics::Mechanism& mechanism) {
  try {
    return robotics::random_poses(mechanism, arguments.simulate, arguments.seed);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(arguments.mechanism + ": " + error.what());
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(arguments.mechanism + ": " + error.what());
  }
}

void simulate_mechanism(const MechanismArguments& arguments, const robotics::Mechanism& mechanism) {
  const Eigen::VectorXd noise = noise_of_readings(mechanism, arguments.noise);
  Eigen::MatrixXd poses = poses_within_limits(arguments, mechanism);
  Random random(arguments.seed + 1);
  for (Eigen::Index row = 0; row < poses.rows(); ++row) {
    for (Eigen::Index i = 0; i < poses.cols(); ++i) poses(row, i) += noise(i) * random.normal();
  }
  put(arguments,
      robotics::to_csv(mechanism, poses, arguments.measure.empty() ? all_names(mechanism) : arguments.measure));
  warn(fmt::format("{}: {} poses simulated{}", mechanism.name, poses.rows(),
                   arguments.output.empty() ? "" : ", written to " + arguments.output));
}

// What the readings of a coordinate look like if most of them are far outside its limits; empty if they are not.
std::string mistake(const robotics::Coordinate& coordinate, const Eigen::VectorXd& readings) {
  const double span = coordinate.upper - coordinate.lower;
  const auto inside = [&](double factor) {
    const auto values = factor * readings.array();
    return (values > coordinate.lower - 0.5 * span && values < coordinate.upper + 0.5 * span).count();
  };
  const Eigen::Index count = readings.array().isFinite().count();
  if (!coordinate.has_limits() || 2 * inside(1.0) >= count) return "";
  constexpr double degrees = 180.0 / std::numbers::pi;
  const char* cause = coordinate.unit != "deg"            ? "check its unit and its sign"
                      : 2 * inside(degrees) > count       ? "they look like radians"
                      : 2 * inside(1.0 / degrees) > count ? "they look like degrees that are called radians"
                                                          : "check its unit, its sign and its zero";
  return fmt::format("column of {}: {} of {} readings are far outside its limits, {} to {} {}: {}", coordinate.name,
                     count - inside(1.0), count, coordinate.lower, coordinate.upper, coordinate.unit, cause);
}

robotics::MechanismTable read_readings(const MechanismArguments& arguments, const robotics::Mechanism& mechanism) {
  robotics::MechanismTable table = robotics::read_mechanism_table(arguments.data, mechanism, arguments.mark);
  if (!table.unused.empty()) {
    std::vector<std::string> missing;
    for (std::size_t i = 0; i < mechanism.coordinates.size(); ++i) {
      const auto column = table.values.col(static_cast<Eigen::Index>(i)).array();
      if (!column.isFinite().any()) missing.push_back(mechanism.coordinates[i].name);
    }
    warn(fmt::format("{}: not used, no coordinates of {}: {}; not measured: {}", arguments.data, mechanism.name,
                     fmt::join(table.unused, ", "),
                     missing.empty() ? "none" : fmt::format("{}", fmt::join(missing, ", "))));
  }
  for (std::size_t i = 0; i < mechanism.coordinates.size(); ++i) {
    const std::string found = mistake(mechanism.coordinates[i], table.values.col(static_cast<Eigen::Index>(i)));
    if (!found.empty()) warn(arguments.data + ": " + found);
  }
  return table;
}

// Names at most ten rows, and what is wrong with each.
void warn_of_rows(const std::string& file, const std::vector<Eigen::Index>& lines,
                  const std::vector<std::string>& why) {
  constexpr std::size_t most = 10;
  for (std::size_t i = 0; i < std::min(most, lines.size()); ++i) {
    warn(fmt::format("{}:{}: {}", file, lines[i], why[i]));
  }
  if (lines.size() > most) warn(fmt::format("{}: {} more rows like these", file, lines.size() - most));
}

void solve_mechanism(const MechanismArguments& arguments, const robotics::Mechanism& mechanism) {
  const robotics::MechanismTable table = read_readings(arguments, mechanism);
  const robotics::Assembly assembly = robotics::assemble(mechanism, table.values);
  std::vector<Eigen::Index> lines;
  std::vector<std::string> why;
  for (std::size_t i = 0; i < assembly.failures.size(); ++i) {
    if (assembly.failures[i].empty()) continue;
    lines.push_back(table.lines[i]);
    why.push_back(assembly.failures[i]);
  }
  warn_of_rows(arguments.data, lines, why);
  put(arguments, robotics::to_csv(mechanism, assembly.coordinates,
                                  arguments.measure.empty() ? all_names(mechanism) : arguments.measure));
  warn(fmt::format("{}: {} of {} poses solved{}", mechanism.name, assembly.failures.size() - lines.size(),
                   assembly.failures.size(), arguments.output.empty() ? "" : ", written to " + arguments.output));
  if (!lines.empty()) {
    throw std::runtime_error(fmt::format("{}: {} poses have no solution", arguments.data, lines.size()));
  }
}

void leave_out(robotics::MechanismTable& table, const std::vector<Eigen::Index>& rows) {
  std::vector<Eigen::Index> kept;
  std::vector<Eigen::Index> lines;
  for (Eigen::Index row = 0; row < table.values.rows(); ++row) {
    if (std::ranges::binary_search(rows, row)) continue;
    kept.push_back(row);
    lines.push_back(table.lines[row]);
  }
  table.values = Eigen::MatrixXd(table.values(kept, Eigen::all));
  table.lines = std::move(lines);
}

// The lines of the poses that contradict the others, which are left out if --robust says so.
std::vector<Eigen::Index> contradicting_lines(const MechanismArguments& arguments, const robotics::Mechanism& mechanism,
                                              robotics::MechanismTable& table) {
  const std::vector<Eigen::Index> rows = robotics::contradicting_poses(mechanism, table.values);
  std::vector<Eigen::Index> lines;
  for (const Eigen::Index row : rows) lines.push_back(table.lines[row]);
  const char* const what = arguments.robust ? "contradicts the other poses: left out"
                                            : "contradicts the other poses; --robust leaves such poses out";
  warn_of_rows(arguments.data, lines, std::vector<std::string>(lines.size(), what));
  if (arguments.robust) leave_out(table, rows);
  return lines;
}

void calibrate_mechanism(const MechanismArguments& arguments, const robotics::Mechanism& mechanism) {
  robotics::MechanismTable table = read_readings(arguments, mechanism);
  const std::vector<Eigen::Index> contradicting = contradicting_lines(arguments, mechanism, table);
  report::MechanismFacts facts{.file = arguments.mechanism,
                               .data = arguments.data,
                               .described = mechanism,
                               .measured = table.values,
                               .folds = static_cast<int>(std::min<Eigen::Index>(arguments.folds, table.values.rows())),
                               .contradicting = contradicting,
                               .robust = arguments.robust};
  facts.calibration = robotics::calibrate(mechanism, table.values);
  facts.before = robotics::errors_of(mechanism, table.values);
  if (facts.folds > 1 && facts.is_determined()) {
    facts.held_out = robotics::held_out_errors(mechanism, table.values, {.count = facts.folds, .seed = arguments.seed});
  }
  std::vector<Eigen::Index> lines;
  for (const Eigen::Index row : facts.calibration.left_out) lines.push_back(table.lines[row]);
  warn_of_rows(arguments.data, lines, facts.calibration.reasons);
  if (!arguments.output.empty() && facts.is_good()) robotics::save(facts.calibration.mechanism, arguments.output);
  if (!arguments.errors.empty()) {
    write_file(arguments.errors, with_decimal_mark(report::mechanism_errors_csv(facts), arguments.mark));
  }
  if (arguments.json) {
    print_json(report::mechanism_json(facts));
  } else {
    print(report::mechanism_text(facts, output_width()));
    if (!arguments.output.empty() && facts.is_good()) print(fmt::format("\nWritten: {}\n", arguments.output));
  }
  if (!facts.is_good()) {
    throw std::runtime_error(arguments.data + ": the parameters are not determined" +
                             (arguments.output.empty() ? "" : "; nothing was written to " + arguments.output));
  }
}

void mechanism_command(const MechanismArguments& arguments) {
  if (arguments.simulate > 0) {
    if (!arguments.data.empty()) throw std::invalid_argument("--simulate makes poses: it takes no file of readings");
    simulate_mechanism(arguments, read_description(arguments.mechanism));
    return;
  }
  if (arguments.data.empty()) throw std::invalid_argument("the readings are missing: a CSV file after the mechanism");
  const robotics::Mechanism mechanism = read_unless_exchanged(
      arguments.mechanism, arguments.data, "the mechanism (YAML) comes first, then the readings (CSV)",
      [](const std::string& path) { return read_description(path); });
  try {
    arguments.solve ? solve_mechanism(arguments, mechanism) : calibrate_mechanism(arguments, mechanism);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(arguments.data + ": " + error.what());
  }
}

}  // namespace

void add_mechanism(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "mechanism",
      "Calibrate a mechanism that is given by its equations, loops included\n"
      "The description has parameters, coordinates of joints and outputs, and the equations that they meet "
      "(docs/mechanisms.md). The table has what is measured; where that is more than the equations need, the "
      "parameters follow: from an instrument that measures the output, or from redundant sensors alone.");
  command->footer("Example: llmt-robot mechanism docs/samples/five_bar.yaml measured.csv -o calibrated.yaml");
  const auto arguments = std::make_shared<MechanismArguments>();
  add_input_file(*command, "mechanism", arguments->mechanism, "Description of the mechanism (YAML)")->required();
  add_input_file(*command, "readings", arguments->data,
                 "CSV file: a row per pose, a column per measured coordinate with its unit (q1_deg, x_mm)");
  command->add_flag("--solve", arguments->solve,
                    "Only complete the poses: solve the equations for what the table does not have");
  add_count(*command, "--simulate", arguments->simulate, Eigen::Index{1},
            "Make this number of random poses within the limits instead of reading them",
            Eigen::Index{most(Limit::simulated_poses)});
  add_names(*command, "--measure", arguments->measure, "NAME",
            "Coordinates that --simulate and --solve write (default: all)");
  add_names(*command, "--noise", arguments->noise, "NAME=NUMBER",
            "Standard deviation of simulated readings in the coordinate's unit (default: sigma of the description)");
  command->add_flag("--robust", arguments->robust, "Leave out poses that contradict the others, and name their lines");
  add_folds(*command, arguments->folds, "Folds of the held-out errors, 0: none");
  add_seed(*command, arguments->seed, "Of folds and simulated poses");
  add_decimal_comma(*command, arguments->mark);
  command->add_flag("--json", arguments->json, "Print the result as JSON");
  add_output_file(*command, "--errors", arguments->errors,
                  "CSV file to write: readings and errors per pose, held out; a tree can learn them (llmt fit)");
  add_output_file(*command, "-o,--output", arguments->output,
                  "File to write: the calibrated description, or the table of --solve and --simulate");
  command->callback([arguments] { mechanism_command(*arguments); });
}

}  // namespace llmt::apps
