#include "report/robot/check_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "report/robot/calibration_facts.hpp"
#include "report/robot/discovery/effect_text.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

using robotics::Moved;
using robotics::RobotCheck;

// Of a group, the parameters by their own names: "x 0.3 +- 0.01 mm".
std::string moved_words(const robotics::Robot& robot, const Moved& moved) {
  std::vector<std::string> changes;
  for (const Moved::Change& change : moved.changes) {
    const bool is_named = moved.changes.size() > 1;
    std::string own = change.parameter.substr(change.parameter.rfind('.') + 1);
    std::ranges::replace(own, '_', ' ');
    changes.push_back(fmt::format("{}{} +- {} {}", is_named ? own + " " : "", number(change.by, 4),
                                  number(change.standard_error, 2), change.unit));
  }
  std::vector<std::string> others;
  for (const std::string& other : moved.or_else) others.push_back(parameter_words(robot, other));
  return fmt::format("  {}: {}{}\n", parameter_words(robot, moved.name), fmt::join(changes, ", "),
                     others.empty() ? "" : fmt::format("; or else {}", fmt::join(others, ", ")));
}

// Each line once; readings of several targets stand in one.
std::vector<Eigen::Index> lines_of(const robotics::Measurements& measurements, const std::vector<Eigen::Index>& rows) {
  std::vector<Eigen::Index> lines;
  for (const Eigen::Index row : rows) lines.push_back(measurements.lines[row]);
  std::ranges::sort(lines);
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
  return lines;
}

std::string bad_text(const CheckFacts& facts) {
  std::string text;
  for (const robotics::BadReading& bad : facts.check.bad) {
    text += fmt::format("  {}: {:.4g} mm\n", facts.face.rows({facts.measurements.lines[bad.row]}, 1), bad.error_mm);
  }
  if (text.empty()) return "";
  const std::size_t count = facts.check.bad.size();
  return fmt::format("{} far from the robot while the others agree, and {} left out:\n{}",
                     count == 1 ? "1 reading lies" : fmt::format("{} readings lie", count), count == 1 ? "was" : "were",
                     text);
}

std::string coverage_text(const CheckFacts& facts) {
  constexpr std::size_t most = 20;
  const robotics::Measurements& measurements = facts.measurements;
  const RobotCheck& check = facts.check;
  std::string text;
  if (!check.has_ranges) {
    text +=
        "The description does not say in which joint ranges it was calibrated: poses beyond them are judged as the "
        "others are. A new calibration writes them.\n";
  }
  if (check.uncovered.empty()) return text;
  const std::vector<Eigen::Index> lines = lines_of(measurements, check.uncovered);
  text += fmt::format("{} of {} readings lie beyond the calibrated ranges ({}):\n", check.uncovered.size(),
                      check.judged.size(), facts.face.rows(lines, most));
  for (const robotics::Beyond& own : check.beyond) {
    text +=
        fmt::format("  {} ({})\n", robotics::to_string(own), facts.face.rows(lines_of(measurements, own.rows), most));
  }
  if (check.too_few_covered) {
    return text + "The others are too few to say what moved.\n";
  }
  text += fmt::format("The other {} decide what moved. {} Their mean error is {:.4f} mm (95 % {:.4f}, max {:.4f}).\n",
                      check.judged.size() - check.uncovered.size(),
                      check.good_where_covered ? "By them the robot is still good." : "By them it is no longer good.",
                      check.covered_error.mean, check.covered_error.p95, check.covered_error.max);
  return text;
}

std::string moved_text(const CheckFacts& facts) {
  const robotics::Robot& robot = facts.robot;
  const RobotCheck& check = facts.check;
  std::string text;
  if (check.moved.empty() && !check.too_few_covered) {
    text += fmt::format(
        "Nothing moved, of {} parameters and groups of them that were tested. Where nothing moved, {:.3g} % of such "
        "checks still name something.\n",
        check.tested, 100.0 * facts.options.level);
  } else if (!check.moved.empty()) {
    text += "\nMoved since the calibration:\n";
    for (const Moved& moved : check.moved) text += moved_words(robot, moved);
    if (!facts.options.same_session && check.moved.front().name.starts_with("tool")) {
      text += "A target that was mounted anew moves the tool; the error above does not suffer.\n";
    }
    text += fmt::format("With base and these identified anew the mean error would be {:.4f} mm.\n", check.refitted_mm);
  }
  if (check.moved_beyond.empty()) return text;
  text +=
      "\nOnly with the readings beyond the calibrated ranges would also be named; there the calibration may be wrong "
      "without anything having moved:\n";
  for (const Moved& moved : check.moved_beyond) text += moved_words(robot, moved);
  return text;
}

}  // namespace

std::string check_summary(const CheckFacts& facts) {
  const RobotCheck& check = facts.check;
  const char* const verdict = check.verdict == robotics::CheckVerdict::still_good            ? "STILL GOOD."
                              : check.verdict == robotics::CheckVerdict::moved_within_limits ? "MOVED, WITHIN LIMITS."
                                                                                             : "NO LONGER GOOD.";
  return fmt::format("{} Mean position error {:.4f} mm (95 % {:.4f}, max {:.4f}); {} {:.4f} mm, good up to {:.4f} mm.",
                     verdict, check.error.mean, check.error.p95, check.error.max,
                     facts.options.accuracy_mm ? "stated" : "at calibration", check.accuracy_mm, check.limit_mm);
}

std::string check_text(const CheckFacts& facts) {
  const robotics::Robot& robot = facts.robot;
  const RobotCheck& check = facts.check;
  std::string text;
  for (const std::string& warning : words(facts.measurements.warnings, facts.face)) text += "Note: " + warning + "\n";
  text += fmt::format("{}: {} poses of {}\n", facts.face.table(facts.data), check.errors_mm.size(), robot.chain.name);
  text += facts.options.same_session ? std::string("The same session: base and tool are those of the calibration.\n\n")
                                     : fmt::format(
                                           "The instrument was set up anew: base and tool were fitted to "
                                           "these poses ({} keeps them).\n\n",
                                           facts.face.switched("same-session"));
  text += check_summary(facts) + "\n";
  text += bad_text(facts);
  if (check.accuracy_is_of_noise) {
    text += fmt::format(
        "The description has no error of these coordinates on poses left out: that figure comes from the poses it was "
        "fitted to, and new poses are worse. {} says what is good enough.\n",
        facts.face.option("accuracy-mm"));
  }
  text += coverage_text(facts);
  text += moved_text(facts);
  if (check.unexplained) {
    text += fmt::format(
        "Something changed that is no parameter of this description: {:.4f} mm per coordinate are left "
        "whatever its values, {:.4f} at calibration. llmt-robot discover looks for the cause.\n",
        check.noise_mm, check.noise_before_mm);
  }
  if (!check.unseen.empty()) {
    std::vector<std::string> unseen;
    for (const std::string& name : check.unseen) unseen.push_back(parameter_words(robot, name));
    text += fmt::format("Not seen by these poses, or taken up by base and tool: {}\n", fmt::join(unseen, "; "));
  }
  if (!check.has_correlations) {
    text += "The description has no correlations of its parameters; small changes may go unnoticed.\n";
  }
  return text;
}

namespace {

Json moved_json(const std::vector<Moved>& all) {
  Json list = Json::array();
  for (const Moved& moved : all) {
    Json entry = {{"name", moved.name}, {"probability", moved.probability}, {"or_else", moved.or_else}};
    for (const Moved::Change& change : moved.changes) {
      entry["changes"].push_back({{"parameter", change.parameter},
                                  {"unit", change.unit},
                                  {"by", change.by},
                                  {"standard_error", change.standard_error}});
    }
    list.push_back(std::move(entry));
  }
  return list;
}

// null where the description does not know its ranges.
Json uncovered_json(const robotics::Measurements& measurements, const RobotCheck& check) {
  if (!check.has_ranges) return nullptr;
  Json joints = Json::array();
  Json conditions = Json::array();
  for (const robotics::Beyond& own : check.beyond) {
    const bool is_condition = own.name == "payload" || own.name == "temperature";
    (is_condition ? conditions : joints)
        .push_back({{is_condition ? "condition" : "joint", own.name},
                    {"unit", own.unit},
                    {"calibrated", {own.measured_low, own.measured_high}},
                    {"used", {own.used_low, own.used_high}},
                    {"lines", lines_of(measurements, own.rows)}});
  }
  const bool is_judged = !check.too_few_covered;
  return {{"readings", check.uncovered.size()},
          {"lines", lines_of(measurements, check.uncovered)},
          {"joints", std::move(joints)},
          {"conditions", std::move(conditions)},
          {"covered_error_mm", is_judged ? figures_json(check.covered_error) : Json(nullptr)},
          {"good_where_covered", is_judged ? Json(check.good_where_covered) : Json(nullptr)},
          {"moved_beyond", moved_json(check.moved_beyond)}};
}

Json bad_json(const CheckFacts& facts) {
  Json list = Json::array();
  for (const robotics::BadReading& bad : facts.check.bad) {
    list.push_back({{"line", facts.measurements.lines[bad.row]}, {"error_mm", bad.error_mm}});
  }
  return list;
}

}  // namespace

Json check_json(const CheckFacts& facts) {
  const RobotCheck& check = facts.check;
  Json json = {{"robot", facts.robot_file},
               {"data", facts.data},
               {"poses", check.errors_mm.size()},
               {"same_session", facts.options.same_session},
               {"verdict", robotics::to_string(check.verdict)},
               {"still_good", check.still_good},
               {"bad", bad_json(facts)},
               {"error_mm", figures_json(check.error)},
               {"accuracy_mm", check.accuracy_mm},
               {"limit_mm", check.limit_mm},
               {"uncovered", uncovered_json(facts.measurements, check)},
               {"moved", moved_json(check.moved)}};
  json["refitted_mm"] = check.refitted_mm;
  json["noise_mm"] = check.noise_mm;
  json["noise_before_mm"] = check.noise_before_mm > 0.0 ? Json(check.noise_before_mm) : Json(nullptr);
  json["unexplained"] = check.unexplained;
  json["tested"] = check.tested;
  json["unseen"] = check.unseen;
  return json;
}

}  // namespace llmt::report
