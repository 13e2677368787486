#include "report/robot/input_checks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "llmt/robotics/effects.hpp"

namespace llmt::report {

void check_positions(const std::string& file, const robotics::Robot& robot, const robotics::Poses& poses) {
  const std::string reason = robotics::position_refusal(robot, poses);
  if (!reason.empty()) throw std::runtime_error(file + ": " + reason);
}

void check_frames(const std::string& file, const robotics::Robot& robot, const robotics::Measurements& measurements,
                  const std::string& advice) {
  const auto lacks = [](const std::vector<robotics::NamedFrame>& frames, const std::string& name) {
    return !name.empty() && std::ranges::find(frames, name, &robotics::NamedFrame::name) == frames.end();
  };
  const std::vector<robotics::Observation>& observations = measurements.poses.observations;
  for (std::size_t row = 0; row < observations.size(); ++row) {
    const bool is_session = lacks(robot.chain.bases, observations[row].base);
    if (!is_session && !lacks(robot.chain.tools, observations[row].tool)) continue;
    const std::string& base = observations[row].base;
    if (is_session && robotics::is_touched(base)) {
      throw std::runtime_error(fmt::format("{}:{}: the {} was not part of the calibration, and shows nothing by itself",
                                           file, measurements.lines[row], base));
    }
    throw std::runtime_error(fmt::format("{}:{}: {} \"{}\" was not part of the calibration{}", file,
                                         measurements.lines[row], is_session ? "session" : "target",
                                         is_session ? base : observations[row].tool, advice));
  }
}

std::optional<Finding> tests_that_took_part(const robotics::Measurements& measurements,
                                            const robotics::Measurements& test) {
  const auto reading = [](const robotics::Measurements& of, Eigen::Index row) {
    const auto joints = of.poses.joints.row(row);
    const auto point = of.positions_mm.row(row);
    std::vector<double> numbers(joints.begin(), joints.end());
    numbers.insert(numbers.end(), point.begin(), point.end());
    return numbers;
  };
  std::set<std::vector<double>> known;
  for (Eigen::Index row = 0; row < measurements.count(); ++row) known.insert(reading(measurements, row));
  Eigen::Index same = 0;
  for (Eigen::Index row = 0; row < test.count(); ++row) same += known.contains(reading(test, row)) ? 1 : 0;
  if (same == 0 || 2 * same < test.count()) return std::nullopt;
  return finding(
      "test_took_part",
      fmt::format("{} of the {} test readings stand among the measurements: they took part, and what is said "
                  "of them is no error on new poses",
                  same, test.count()));
}

robotics::CorrectedRobot arm_alone(const std::string& file, robotics::CorrectedRobot robot, const Warn& warn) {
  const std::vector<robotics::Effect> all = robot.robot.effects;
  robot.robot = robotics::without_errors_of_measuring(std::move(robot.robot));
  std::vector<std::string> titles;
  for (const robotics::Effect& effect : all) {
    if (robotics::effect_type(effect.type).of_measuring) titles.push_back(robotics::effect_type(effect.type).title);
  }
  if (!titles.empty()) {
    warn(finding("errors_of_measuring",
                 fmt::format("{}: left out, because they were errors of the measurement and not of the arm: {}", file,
                             fmt::join(titles, ", "))));
  }
  return robot;
}

void name_made_up(const robotics::Poses& given, const robotics::Poses& completed, const Warn& warn) {
  std::vector<std::string> names;
  for (const auto& [name, values] : completed.covariates) {
    if (!given.covariates.contains(name)) names.push_back(name);
  }
  if (names.empty()) return;
  warn(finding("columns_made_up",
               fmt::format("Columns that effects need and the table does not have: {}. Directions and moves are those "
                           "of going from row to row, order counts the rows, everything else is neutral "
                           "(docs/commands.md)",
                           fmt::join(names, ", "))));
}

void name_uncovered(const robotics::Robot& robot, const robotics::Poses& used, const Warn& warn) {
  if (!robot.calibration) return;
  const std::vector<robotics::Beyond> beyond = robotics::beyond_calibrated(robot.chain, *robot.calibration, used);
  if (beyond.empty()) return;
  std::vector<std::string> ranges;
  for (const robotics::Beyond& own : beyond) ranges.push_back(robotics::to_string(own));
  warn(finding("beyond_calibrated",
               fmt::format("{} of {} poses lie beyond the calibrated ranges: {}. No measurement says how far the model "
                           "is off there",
                           robotics::rows_beyond(beyond).size(), used.count(), fmt::join(ranges, "; "))));
}

std::string frames_text(const robotics::Chain& chain, const robotics::Poses& used) {
  std::set<std::string> sessions;
  std::set<std::string> targets;
  for (const robotics::Observation& seen : used.observations) {
    sessions.insert(seen.base.empty() ? chain.session : seen.base);
    targets.insert(seen.tool.empty() ? chain.target : seen.tool);
  }
  if (used.observations.empty()) {
    sessions = {chain.session};
    targets = {chain.target};
  }
  const auto named = [](const std::set<std::string>& names, const char* what, const char* of_rows) -> std::string {
    if (names.size() > 1) return of_rows;
    return names.begin()->empty() ? "" : fmt::format(" {} {}", what, *names.begin());
  };
  if (targets == sessions) targets = {""};  // a session's own tool has its name
  const std::string target = named(targets, "target", " target of each row");
  return fmt::format("of the{}, in the frame of the instrument{}", target.empty() ? " tool" : target,
                     named(sessions, "in the session", " in the session of each row"));
}

std::string use_of_orientations(const robotics::Measurements& measurements, const Face& face) {
  if (measurements.orientation.values.size() == 0 || !robotics::orientation_rows(measurements.poses).empty()) return "";
  return fmt::format("The file has orientations. Only the positions are used; {} uses both.",
                     face.switched("orientations"));
}

}  // namespace llmt::report
