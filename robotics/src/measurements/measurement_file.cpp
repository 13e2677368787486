#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <stdexcept>

#include "effects/effect_entries.hpp"
#include "kinematics/units.hpp"
#include "llmt/csv.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {
namespace {

const std::map<std::string, double> lengths_in_mm = {{"mm", 1.0}, {"m", 1000.0}, {"um", 0.001}};
const std::map<std::string, double> angles_in_rad = {{"rad", 1.0}, {"deg", radians}};

// A header, sorted into what it means.
class Header {
 public:
  Header(const Csv& csv, const Robot& robot, const std::vector<std::string>& also)
      : csv_(csv), robot_(robot), also_(also.begin(), also.end()) {
    for (const Effect& effect : robot.effects) {
      for (const FormulaTerm& term : effect.formula.terms) {
        const std::vector<std::string> names = names_in_formula(term.text);
        also_.insert(names.begin(), names.end());
      }
    }
    for (const std::string& column : csv.columns()) {
      if (!take_named_joint(column)) take(column);
    }
  }

  bool has(const std::string& quantity) const { return quantities_.contains(quantity); }
  bool has_joints() const { return quantities_.lower_bound("q0") != quantities_.lower_bound("q:"); }  // q1, q2, ...
  bool in_degrees(const std::string& quantity) const { return quantities_.at(quantity).unit == "deg"; }
  Eigen::MatrixXd joints() const;
  void positions(Measurements& measurements) const;
  Orientation orientation() const;
  std::map<std::string, Eigen::VectorXd> covariates() const;
  const std::vector<std::string>& unused() const { return unused_; }

 private:
  struct Quantity {
    std::string column;
    std::string unit;
  };

  const Csv& csv_;
  const Robot& robot_;
  std::set<std::string> also_;
  std::map<std::string, Quantity> quantities_;  // "q1", "x", "rx", "qw" -> column and unit
  std::vector<std::string> covariates_;
  std::vector<std::string> unused_;

  [[noreturn]] void refuse(const std::string& message) const {
    throw std::runtime_error(fmt::format("{}:1: {}", csv_.name(), message));
  }
  bool take_named_joint(const std::string& column);
  void take(const std::string& column);
  void take_quantity(const std::string& name, const std::string& column, const std::string& unit);
  void check_reach(const Eigen::VectorXd& coordinate_mm, const std::string& column) const;
  double factor(const std::string& name, const std::map<std::string, double>& units) const;
  static std::string spellings(const std::string& name, const std::map<std::string, double>& units);
};

void Header::take(const std::string& column) {
  static const std::regex quantity("(q[0-9]+|r?[xyz])(_([A-Za-z]+))?");
  static const std::regex quaternion("q[wxyz]");
  static const std::regex covariate(
      "payload_kg|temp[0-9]*_C|time_s|order|pose|returned|dwelled|dir[0-9]+|tau[0-9]+_Nm|qmeas[0-9]+_(deg|rad|mm)|"
      "sigma_[xyz]_(um|mm)");
  std::smatch parts;
  if (std::regex_match(column, parts, quantity)) {
    take_quantity(parts[1], column, parts[3]);
  } else if (std::regex_match(column, quaternion)) {
    quantities_[column] = {column, ""};
  } else if (std::regex_match(column, covariate) || also_.contains(column)) {
    covariates_.push_back(column);
  } else {
    unused_.push_back(column);
  }
}

// "shoulder_pan_joint_rad": a joint by its name in the description, as logs of controllers have them.
bool Header::take_named_joint(const std::string& column) {
  const std::size_t bar = column.rfind('_');
  if (bar == std::string::npos) return false;
  const std::string unit = column.substr(bar + 1);
  if (!lengths_in_mm.contains(unit) && !angles_in_rad.contains(unit)) return false;
  const std::vector<Joint>& joints = robot_.chain.joints;
  const auto joint = std::ranges::find(joints, column.substr(0, bar), &Joint::name);
  if (joint == joints.end()) return false;
  take_quantity(fmt::format("q{}", joint - joints.begin() + 1), column, unit);
  return true;
}

std::string Header::spellings(const std::string& name, const std::map<std::string, double>& units) {
  std::string text;
  for (const auto& [unit, factor] : units) text += fmt::format("{}{}_{}", text.empty() ? "" : " or ", name, unit);
  return text;
}

void Header::take_quantity(const std::string& name, const std::string& column, const std::string& unit) {
  const bool is_position = name.size() == 1;
  const bool is_joint = name[0] == 'q';
  if (unit.empty()) {
    const std::string expected = is_position ? spellings(name, lengths_in_mm) : spellings(name, angles_in_rad);
    refuse(fmt::format("column \"{}\" has no unit: write {}{}", column, expected,
                       is_joint ? fmt::format(" (a prismatic joint: {})", spellings(name, lengths_in_mm)) : ""));
  }
  const auto [before, is_new] = quantities_.try_emplace(name, Quantity{column, unit});
  if (!is_new) refuse(fmt::format("columns \"{}\" and \"{}\" are the same quantity", before->second.column, column));
  const bool known = (is_position || is_joint ? lengths_in_mm.contains(unit) : false) ||
                     (is_position ? false : angles_in_rad.contains(unit));
  if (!known) {
    refuse(fmt::format("column \"{}\": unit \"{}\" is not known: write {}", column, unit,
                       spellings(name, is_position ? lengths_in_mm : angles_in_rad)));
  }
}

double Header::factor(const std::string& name, const std::map<std::string, double>& units) const {
  const Quantity& quantity = quantities_.at(name);
  const auto found = units.find(quantity.unit);
  if (found == units.end()) {
    refuse(fmt::format("column \"{}\": unit \"{}\" does not suit, write {}", quantity.column, quantity.unit,
                       spellings(name, units)));
  }
  return found->second;
}

Eigen::MatrixXd Header::joints() const {
  const std::vector<Joint>& joints = robot_.chain.joints;
  std::vector<std::string> columns;
  Eigen::RowVectorXd factors(std::ssize(joints));
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::string name = fmt::format("q{}", j + 1);
    const auto& units = joints[j].type == JointType::revolute ? angles_in_rad : lengths_in_mm;
    if (!quantities_.contains(name)) {
      const std::string& own = joints[j].name;
      if (csv_.has(own)) refuse(fmt::format("column \"{0}\" has no unit: name it {0}_deg or {0}_rad", own));
      const bool is_named = csv_.columns().front().find_first_not_of("0123456789.,+-eE") != std::string::npos;
      refuse(fmt::format("robot \"{}\" has {} joints, there is no column {} for {}; columns: {}{}", robot_.chain.name,
                         joints.size(), spellings(name, units), joints[j].name, fmt::join(csv_.columns(), ", "),
                         is_named ? "" : "; the first line must hold the names of the columns"));
    }
    factors(j) = factor(name, units);
    columns.push_back(quantities_.at(name).column);
  }
  for (const auto& [name, quantity] : quantities_) {
    const bool is_joint = name[0] == 'q' && name.find_first_not_of("0123456789", 1) == std::string::npos;
    if (is_joint && std::ranges::find(columns, quantity.column) == columns.end()) {
      refuse(
          fmt::format("column \"{}\": robot \"{}\" has {} joints", quantity.column, robot_.chain.name, joints.size()));
    }
  }
  Eigen::MatrixXd values = csv_.numbers(columns);
  values.array().rowwise() *= factors.array();
  return values;
}

void Header::positions(Measurements& measurements) const {
  measurements.positions_mm = Eigen::MatrixXd::Zero(csv_.rows(), 3);
  measurements.measured = {false, false, false};
  const std::vector<std::string> names = {"x", "y", "z"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!quantities_.contains(names[axis])) continue;
    measurements.measured[axis] = true;
    measurements.positions_mm.col(axis) =
        factor(names[axis], lengths_in_mm) * csv_.numbers(quantities_.at(names[axis]).column);
    check_reach(measurements.positions_mm.col(axis), quantities_.at(names[axis]).column);
  }
  if (std::ranges::none_of(measurements.measured, [](bool seen) { return seen; })) {
    refuse(fmt::format("no measured position: write x_mm, y_mm, z_mm (or _m, _um); columns: {}",
                       fmt::join(csv_.columns(), ", ")));
  }
}

void Header::check_reach(const Eigen::VectorXd& coordinate_mm, const std::string& column) const {
  for (Eigen::Index row = 0; row < coordinate_mm.size(); ++row) {
    if (std::abs(coordinate_mm(row)) <= farthest_mm) continue;
    throw std::runtime_error(fmt::format("{}:{}: column \"{}\": {} mm, at most {:g} mm are possible", csv_.name(),
                                         csv_.line_of(row), column, coordinate_mm(row), farthest_mm));
  }
}

Orientation Header::orientation() const {
  Orientation orientation;
  const auto all_there = [&](const std::vector<std::string>& names) {
    return std::ranges::all_of(names, [&](const std::string& name) { return quantities_.contains(name); });
  };
  const std::vector<std::string> angles = {"rx", "ry", "rz"};
  const std::vector<std::string> quaternion = {"qw", "qx", "qy", "qz"};
  if (all_there(angles)) {
    orientation.values.resize(csv_.rows(), 3);
    for (std::size_t k = 0; k < 3; ++k) {
      const Quantity& quantity = quantities_.at(angles[k]);
      const double to_deg = quantity.unit == "deg" ? 1.0 : factor(angles[k], angles_in_rad) / radians;
      orientation.values.col(k) = to_deg * csv_.numbers(quantity.column);
    }
  } else if (all_there(quaternion)) {
    orientation.kind = Orientation::Kind::quaternion;
    orientation.values = csv_.numbers(quaternion);
  }
  return orientation;
}

// Angles that the controller read back are kept in rad like the joint values.
std::map<std::string, Eigen::VectorXd> Header::covariates() const {
  std::map<std::string, Eigen::VectorXd> values;
  for (const std::string& column : covariates_) {
    const bool in_degrees = column.starts_with("qmeas") && column.ends_with("_deg");
    const std::string name = in_degrees ? column.substr(0, column.size() - 4) + "_rad" : column;
    if (!values.try_emplace(name, (in_degrees ? radians : 1.0) * csv_.numbers(column)).second) {
      refuse(fmt::format("column \"{}\" is the same quantity as another one in rad", column));
    }
  }
  return values;
}

// Instruments that lose the target often write zeros: such rows are no measurements.
std::vector<Eigen::Index> seen_rows(const Csv& csv, Measurements& measurements) {
  std::vector<Eigen::Index> seen;
  std::vector<Eigen::Index> missing;
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    if (measurements.positions_mm.row(i).isZero(0.0)) {
      missing.push_back(i);
    } else {
      seen.push_back(i);
    }
  }
  if (!missing.empty()) {
    measurements.warnings.push_back(fmt::format(
        "{}: {} of {} points are exactly zero, taken as missing and left out: line{} {}", csv.name(), missing.size(),
        csv.rows(), missing.size() == 1 ? "" : "s", fmt::join(csv.lines_of(missing), ", ")));
  }
  return seen;
}

Measurements from_csv(const Csv& csv, const Robot& robot, const std::vector<std::string>& also) {
  const Header header(csv, robot, also);
  Measurements measurements;
  measurements.poses.joints = header.joints();
  measurements.poses.covariates = header.covariates();
  // Before rows are left out: the arm was there although the point was not seen.
  add_moves(measurements.poses, robot.chain);
  header.positions(measurements);
  measurements.orientation = header.orientation();
  const std::vector<Eigen::Index> seen = seen_rows(csv, measurements);
  std::vector<std::string> warnings = std::move(measurements.warnings);
  if (std::ssize(seen) < measurements.count()) measurements = select(measurements, seen);
  measurements.warnings = std::move(warnings);
  measurements.unused_columns = header.unused();
  if (measurements.count() == 0) throw std::runtime_error(fmt::format("{}: there are no measured points", csv.name()));
  return measurements;
}

}  // namespace

Measurements read_measurements(const std::string& path, const Robot& robot, const std::vector<std::string>& also,
                               DecimalMark mark) {
  return from_csv(Csv::read(path, mark), robot, also);
}

Measurements parse_measurements(std::string text, const std::string& name, const Robot& robot,
                                const std::vector<std::string>& also, DecimalMark mark) {
  return from_csv(Csv::parse(std::move(text), name, mark), robot, also);
}

Poses read_poses(const std::string& path, const Robot& robot, DecimalMark mark) {
  const Csv csv = Csv::read(path, mark);
  const Header header(csv, robot, {});
  Poses poses{.joints = header.joints(), .covariates = header.covariates()};
  if (poses.count() == 0) throw std::runtime_error(fmt::format("{}: there are no poses", csv.name()));
  add_moves(poses, robot.chain);
  return poses;
}

TargetTable read_targets(const std::string& path, const Robot& robot, DecimalMark mark) {
  const Csv csv = Csv::read(path, mark);
  const Header header(csv, robot, {});
  TargetTable targets;
  for (Eigen::Index row = 0; row < csv.rows(); ++row) targets.lines.push_back(csv.line_of(row));
  if (targets.lines.empty()) throw std::runtime_error(fmt::format("{}: there are no targets", csv.name()));
  if (header.has_joints()) {
    targets.joints = header.joints();
    targets.joints_in_degrees = header.in_degrees("q1");
  }
  if (header.has("x") || header.has("y") || header.has("z")) {
    for (const char* axis : {"x", "y", "z"}) {
      if (!header.has(axis)) {
        throw std::runtime_error(
            fmt::format("{}:1: a target needs x, y and z, there is no column {}_mm", csv.name(), axis));
      }
    }
    Measurements measured;
    header.positions(measured);
    targets.positions_mm = measured.positions_mm;
  }
  if (targets.joints.size() == 0 && targets.positions_mm.size() == 0) {
    throw std::runtime_error(
        fmt::format("{}:1: neither joints (q1_deg, ...) nor positions (x_mm, y_mm, z_mm); columns: {}", csv.name(),
                    fmt::join(csv.columns(), ", ")));
  }
  targets.orientation = header.orientation();
  targets.covariates = header.covariates();
  targets.unused_columns = header.unused();
  return targets;
}

std::string to_csv(const Measurements& measurements, const Robot& robot) {
  validate(measurements, robot);
  std::vector<std::string> names;
  std::vector<Eigen::VectorXd> columns;
  const auto add = [&](const std::string& name, const Eigen::VectorXd& values) {
    names.push_back(name);
    columns.push_back(values);
  };
  for (std::size_t j = 0; j < robot.chain.joints.size(); ++j) {
    add(fmt::format("q{}_{}", j + 1, robot.chain.joints[j].type == JointType::revolute ? "rad" : "mm"),
        measurements.poses.joints.col(j));
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (measurements.measured[axis]) add(fmt::format("{}_mm", "xyz"[axis]), measurements.positions_mm.col(axis));
  }
  const bool angles = measurements.orientation.kind == Orientation::Kind::angles_deg;
  for (Eigen::Index k = 0; k < measurements.orientation.values.cols(); ++k) {
    add(angles ? fmt::format("r{}_deg", "xyz"[k]) : fmt::format("q{}", "wxyz"[k]),
        measurements.orientation.values.col(k));
  }
  for (const auto& [name, values] : measurements.poses.covariates) {
    if (!is_move(name)) add(name, values);
  }
  std::string text = fmt::format("{}\n", fmt::join(names, ","));
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    for (std::size_t c = 0; c < columns.size(); ++c) text += fmt::format("{}{}", c == 0 ? "" : ",", columns[c](i));
    text += '\n';
  }
  return text;
}

}  // namespace llmt::robotics
