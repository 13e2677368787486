#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

#include "llmt/csv.hpp"
#include "llmt/robotics/measurements.hpp"
#include "measurements/header.hpp"
#include "measurements/named_frames.hpp"
#include "measurements/reference_rows.hpp"
#include "measurements/sightings.hpp"

namespace llmt::robotics {
namespace {

// "sphere" of a known sphere, too.
std::string column_of_feature(const std::string& feature) { return feature.substr(feature.rfind(' ') + 1); }

// The robot's frame that a name of the file stands for: the frame of that name, or the chain's own where that has
// this name or none yet, or else one that calibration is to add.
class FrameNames {
 public:
  FrameNames(const std::vector<NamedFrame>& known, std::string own) : own_(std::move(own)) {
    for (const NamedFrame& frame : known) known_.insert(frame.name);
  }
  std::string operator()(const std::string& name) {
    if (name.empty()) own_is_unnamed_ = own_.empty();
    if (name.empty() || known_.contains(name)) return name;
    if (own_.empty() && !own_is_unnamed_) own_ = name;
    return name == own_ ? "" : name;
  }
  const std::string& own() const { return own_; }

 private:
  std::set<std::string> known_;
  std::string own_;
  bool own_is_unnamed_ = false;  // another name is then another frame
};

// Numbers of the stands of the arm. Rows of a column of targets with the same joint values, `pose` and session are one
// stand; where times or an order are told, only if they follow each other.
std::vector<Eigen::Index> stands_of(const Poses& rows, const std::vector<std::string>& sessions, bool has_targets) {
  std::vector<Eigen::Index> stands(rows.count());
  const auto pose = rows.covariates.find("pose");
  const bool has_order = rows.covariates.contains("order") || rows.covariates.contains("time_s");
  std::map<std::vector<double>, Eigen::Index> known;
  std::map<std::string, double> session_numbers;
  Eigen::Index next = 0;
  std::vector<double> before;
  for (Eigen::Index i = 0; i < rows.count(); ++i) {
    std::vector<double> key(rows.joints.row(i).begin(), rows.joints.row(i).end());
    if (pose != rows.covariates.end()) key.push_back(pose->second(i));
    if (!sessions.empty()) {
      key.push_back(
          session_numbers.try_emplace(sessions[i], static_cast<double>(session_numbers.size())).first->second);
    }
    if (!has_targets) {
      stands[i] = next++;
    } else if (has_order) {
      stands[i] = i > 0 && key == before ? stands[i - 1] : next++;
    } else {
      const auto [place, is_new] = known.try_emplace(key, next);
      if (is_new) ++next;
      stands[i] = place->second;
    }
    before = std::move(key);
  }
  return stands;
}

// Two names that differ in a dot would be one frame.
void refuse_same_but_for_dots(const Csv& csv, const std::vector<std::string>& names, const char* column) {
  std::map<std::string, std::string> meant;
  for (std::size_t row = 0; row < names.size(); ++row) {
    const auto [known, is_new] = meant.try_emplace(without_dots(names[row]), names[row]);
    if (is_new || known->second == names[row]) continue;
    csv.refuse(static_cast<Eigen::Index>(row), column,
               fmt::format("\"{}\" and \"{}\" differ only in a dot, which counts as _: write one name otherwise",
                           known->second, names[row]));
  }
}

// Fills in the observations, and what the robot's own frames are called.
void observe(const Csv& csv, const Header& header, const Robot& robot, const Poses& rows,
             const std::vector<Sighting>& seen, Measurements& measurements) {
  const std::vector<std::string> sessions = header.words("session");
  refuse_same_but_for_dots(csv, sessions, "session");
  const std::vector<std::string> targets = header.words("target");
  refuse_same_but_for_dots(csv, targets, "target");
  for (const char* column : {"socket", "plane", "sphere"}) refuse_same_but_for_dots(csv, header.words(column), column);
  const bool has_targets = !targets.empty();
  const std::vector<Eigen::Index> stands = stands_of(rows, sessions, has_targets);
  const std::map<std::string, std::vector<std::string>> features = {{"socket", header.words("socket")},
                                                                    {"plane", header.words("plane")},
                                                                    {"sphere", header.words("sphere")},
                                                                    {"from", header.words("from")}};
  FrameNames base_of(robot.chain.bases, robot.chain.session);
  FrameNames tool_of(robot.chain.tools, robot.chain.target);
  std::vector<Observation>& observations = measurements.poses.observations;
  for (const Sighting& sighting : seen) {
    Observation& observation = observations.emplace_back();
    const auto named = [&](const std::vector<std::string>& words, const std::string& column) {
      if (words.empty()) return std::string();
      if (words[sighting.row].empty()) csv.refuse(sighting.row, column, "the name is missing");
      constexpr std::size_t longest = 200;
      if (words[sighting.row].size() > longest) csv.refuse(sighting.row, column, "a name has at most 200 characters");
      return without_dots(words[sighting.row]);
    };
    const std::string session = named(sessions, "session");
    if (is_touched(session)) {
      csv.refuse(sighting.row, "session",
                 "a session's name does not begin with \"socket \", \"plane \", \"sphere \" or \"known sphere \"");
    }
    const std::string target = has_targets ? named(targets, "target") : sighting.target;
    observation.base = base_of(session);
    // A target that was mounted anew is another tool.
    std::string tool = observation.base;
    if (!target.empty()) tool = tool.empty() ? target : fmt::format("{}/{}", tool, target);
    observation.tool = tool_of(tool);
    if (!sighting.feature.empty()) {
      if (!observation.base.empty()) {
        csv.refuse(sighting.row, "session",
                   fmt::format("a {} belongs to the first session of the file, \"{}\": put that name here, or put the "
                               "rows of this session first",
                               column_of_feature(sighting.feature), base_of.own()));
      }
      const std::string column = sighting.is_length ? "from" : column_of_feature(sighting.feature);
      observation.base = fmt::format("{} {}", sighting.feature, named(features.at(column), column));
    }
    observation.stand = stands[sighting.row];
    const bool is_distance = sighting.feature.empty() ? header.has("distance") : sighting.feature.ends_with("sphere");
    if (is_distance || sighting.is_length) observation.reading = Reading::distance;
  }
  const bool plain = std::ranges::all_of(observations, [](const Observation& o) {
    return o.base.empty() && o.tool.empty() && o.reading == Reading::position;
  });
  if (plain) observations.clear();
  measurements.session = base_of.own();
  measurements.target = tool_of.own();
}

Measurements from_csv(const Csv& all, const Robot& robot, const std::vector<std::string>& also, const ColumnMap& map) {
  const ReferenceRows split = reference_rows(all, map);
  const Csv csv = all.with_rows(split.others);
  const Header header(csv, robot, also, map);
  Measurements measurements;
  Poses rows{.joints = header.joints(), .covariates = header.covariates()};
  // Before rows are left out: the arm was there although the point was not seen.
  add_moves(rows, robot.chain);
  const std::vector<Sighting> seen = sightings_of(csv, header, measurements);
  if (seen.empty()) throw std::runtime_error(fmt::format("{}: there are no measured points", csv.name()));
  std::vector<Eigen::Index> kept;
  measurements.positions_mm.resize(std::ssize(seen), 3);
  for (const Sighting& sighting : seen) {
    measurements.positions_mm.row(std::ssize(kept)) = sighting.value.transpose();
    kept.push_back(sighting.row);
  }
  measurements.lines = csv.lines_of(kept);
  measurements.poses = select(rows, kept);
  observe(csv, header, robot, rows, seen, measurements);
  measurements.orientation = header.orientation();
  measurements.orientation.convention = map.orientation;
  if (measurements.orientation.values.size() != 0) {
    measurements.orientation.values = Eigen::MatrixXd(measurements.orientation.values(kept, Eigen::all));
  }
  for (Eigen::Index& row : kept) row = split.others[row];
  take_off_drift(all, split, robot, map, kept, measurements);
  measurements.unused_columns = header.unused();
  for (Finding& hint : header.hints()) measurements.warnings.push_back(std::move(hint));
  return measurements;
}

// `with_frames`: of sessions and targets that the robot has by name. Without them there is one row for each stand of
// the arm, whatever was looked at.
PoseTable pose_table_of(const Csv& all, const Robot& robot, const ColumnMap& given, bool with_frames) {
  const ColumnMap map = for_columns_of(all, given);
  const Csv csv = all.with_rows(reference_rows(all, map).others);
  const Header header(csv, robot, {}, map);
  Poses poses{.joints = header.joints(), .covariates = header.covariates()};
  if (poses.count() == 0) throw std::runtime_error(fmt::format("{}: there are no poses", csv.name()));
  add_moves(poses, robot.chain);
  if (with_frames) {
    poses.observations = known_frames(csv, robot.chain, header.words("session"), header.words("target"));
  }
  if (header.words("target").empty() || !poses.observations.empty()) return {std::move(poses), header.joint_columns()};
  // Several targets were looked at from one pose.
  const std::vector<Eigen::Index> stands = stands_of(poses, header.words("session"), true);
  std::vector<Eigen::Index> first;
  std::set<Eigen::Index> known;
  for (Eigen::Index row = 0; row < poses.count(); ++row) {
    if (known.insert(stands[row]).second) first.push_back(row);
  }
  return {select(poses, first), header.joint_columns()};
}

}  // namespace

Measurements read_measurements(const std::string& path, const Robot& robot, const std::vector<std::string>& also,
                               DecimalMark mark, const ColumnMap& map) {
  return from_csv(Csv::read(path, map.decimal.value_or(mark)), robot, also, map);
}

Measurements parse_measurements(std::string text, const std::string& name, const Robot& robot,
                                const std::vector<std::string>& also, DecimalMark mark, const ColumnMap& map) {
  return from_csv(Csv::parse(std::move(text), name, map.decimal.value_or(mark)), robot, also, map);
}

PoseTable read_pose_table(const std::string& path, const Robot& robot, DecimalMark mark, const ColumnMap& map) {
  return pose_table_of(Csv::read(path, map.decimal.value_or(mark)), robot, map, true);
}

PoseTable parse_pose_table(std::string text, const std::string& name, const Robot& robot, DecimalMark mark,
                           const ColumnMap& map) {
  return pose_table_of(Csv::parse(std::move(text), name, map.decimal.value_or(mark)), robot, map, true);
}

Poses read_poses(const std::string& path, const Robot& robot, DecimalMark mark, const ColumnMap& map) {
  return pose_table_of(Csv::read(path, map.decimal.value_or(mark)), robot, map, false).poses;
}

}  // namespace llmt::robotics
