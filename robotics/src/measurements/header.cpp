#include "measurements/header.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <stdexcept>

#include "effects/effect_entries.hpp"
#include "kinematics/units.hpp"

namespace llmt::robotics {
namespace {

using Units = std::map<std::string, double>;
const Units lengths_in_mm = {{"mm", 1.0}, {"m", 1000.0}, {"um", 0.001}};
const Units angles_in_rad = {{"rad", 1.0}, {"deg", radians}};

bool is_joint(const std::string& quantity) {
  return quantity.size() > 1 && quantity[0] == 'q' && quantity.find_first_not_of("0123456789", 1) == std::string::npos;
}

// "t2_x" -> "t2_".
std::string target_of(const std::string& quantity) {
  const std::size_t bar = quantity.rfind('_');
  return bar == std::string::npos ? "" : quantity.substr(0, bar + 1);
}

std::string spellings(const std::string& name, const Units& units) {
  std::string text;
  for (const auto& [unit, factor] : units) text += fmt::format("{}{}_{}", text.empty() ? "" : " or ", name, unit);
  return text;
}

bool is_angle(const std::string& quantity) { return quantity.size() == 2 && quantity[0] == 'r'; }

}  // namespace

ColumnMap for_columns_of(const Csv& csv, ColumnMap map) {
  std::erase_if(map.names, [&](const auto& entry) { return !csv.has(entry.first); });
  return map;
}

void Header::refuse(const std::string& message) const {
  throw std::runtime_error(fmt::format("{}:1: {}", csv_.name(), message));
}

Header::Header(const Csv& csv, const Robot& robot, const std::vector<std::string>& also, const ColumnMap& map)
    : csv_(csv), robot_(robot), also_(also.begin(), also.end()) {
  for (const Effect& effect : robot.effects) {
    for (const FormulaTerm& term : effect.formula.terms) {
      const std::vector<std::string> names = names_in_formula(term.text);
      also_.insert(names.begin(), names.end());
    }
  }
  for (const auto& [column, name] : map.names) {
    if (!csv.has(column)) refuse(fmt::format("there is no column \"{}\", which the column map calls {}", column, name));
  }
  const auto name_of = [&](const std::string& column) {
    const auto mapped = map.names.find(column);
    return mapped == map.names.end() ? column : mapped->second;
  };
  std::set<std::string> names;
  for (const std::string& column : csv.columns()) names.insert(name_of(column));
  look_for_named_joints(names);
  has_radii_ = names.contains("sphere");
  for (const std::string& column : csv.columns()) {
    const std::string name = name_of(column);
    if (!take_named_joint(name, column)) take(name, column);
    if (map.names.contains(column) && !unused_.empty() && unused_.back() == column) {
      refuse(
          fmt::format("the column map calls \"{}\" \"{}\", which is no column that has a meaning here", column, name));
    }
  }
  if (targets_.size() > 1 && targets_.front().empty() != targets_.back().empty()) {
    refuse("there are positions without a target (x_mm) and with one (t1_x_mm): name them all");
  }
  const bool has_sockets = words_.contains("socket");
  if (words_.contains("from") && !(has_sockets && has("distance"))) {
    refuse(
        "a column from names the socket that a length is measured from: it needs the columns socket and distance_mm");
  }
  if (has_sockets && has("distance") && !words_.contains("from")) {
    refuse(
        "there are sockets and distances: a column from names the socket that a distance is measured from, where it is "
        "the length between two sockets; distances from an instrument are fitted in a file of their own");
  }
  const bool has_readings = !targets_.empty() || (has("distance") && !has_sockets);
  if ((has_plane() && (has_readings || has_sockets || has_sphere())) || (has_sphere() && has_readings)) {
    refuse(fmt::format("points on {} have no other readings beside them: fit them one after the other",
                       has_plane() ? "planes" : "spheres"));
  }
  if (!targets_.empty() && has("distance")) refuse("there are positions and distances: fit them one after the other");
}

void Header::take(const std::string& name, const std::string& column) {
  static const std::regex quantity("(q[0-9]+|r[xyz]|(t[0-9]+_)?[xyz]|distance|radius)(_([A-Za-z]+))?");
  static const std::regex quaternion("q[wxyz]");
  static const std::set<std::string> words = {"target", "session", "socket", "plane", "sphere", "reference", "from"};
  static const std::regex covariate(
      "payload_kg|temp[0-9]*_C|time_s|order|pose|returned|dwelled|dir[0-9]+|tau[0-9]+_Nm|qmeas[0-9]+_(deg|rad|mm)|"
      "(sigma|U95)(_[xyz])?_(um|mm)");
  std::smatch parts;
  if (std::regex_match(name, parts, quantity) && (parts[1] != "radius" || has_radii_)) {
    take_quantity(parts[1], column, parts[4]);
  } else if (std::regex_match(name, quaternion)) {
    quantities_[name] = {column, ""};
  } else if (words.contains(name)) {
    words_[name] = column;
  } else if (std::regex_match(name, covariate) || also_.contains(name)) {
    if (!covariates_.try_emplace(name, column).second) refuse(fmt::format("there are two columns {}", name));
  } else {
    unused_.push_back(column);
  }
}

// Joints may be called q1 like the columns of joints by number. Columns are names where every joint has one.
void Header::look_for_named_joints(const std::set<std::string>& names) {
  const auto has_column = [&](const std::string& joint) {
    const auto has = [&](const auto& unit) { return names.contains(joint + "_" + unit.first); };
    return std::ranges::any_of(angles_in_rad, has) || std::ranges::any_of(lengths_in_mm, has);
  };
  bool by_number = true;
  bool in_order = has_named_joints_ = true;
  for (std::size_t j = 0; j < robot_.chain.joints.size(); ++j) {
    const Joint& joint = robot_.chain.joints[j];
    const std::string number = fmt::format("q{}", j + 1);
    in_order = in_order && (!is_joint(joint.name) || joint.name == number);
    by_number = by_number && (joint.mimic || has_column(number));
    has_named_joints_ = has_named_joints_ && (joint.mimic || has_column(joint.name));
  }
  if (!has_named_joints_ || !by_number || in_order) return;
  refuse("joints have each other's numbers as names, so that q1 means two of them: rename them in the description");
}

// "shoulder_pan_joint_rad": a joint by its name in the description, as logs of controllers have them.
bool Header::take_named_joint(const std::string& name, const std::string& column) {
  const std::size_t bar = name.rfind('_');
  if (bar == std::string::npos) return false;
  const std::string unit = name.substr(bar + 1);
  if (!lengths_in_mm.contains(unit) && !angles_in_rad.contains(unit)) return false;
  const std::vector<Joint>& joints = robot_.chain.joints;
  const auto joint = std::ranges::find(joints, name.substr(0, bar), &Joint::name);
  if (joint == joints.end()) return false;
  const std::string number = fmt::format("q{}", joint - joints.begin() + 1);
  if (is_joint(joint->name) && joint->name != number && !has_named_joints_) return false;
  take_quantity(number, column, unit);
  return true;
}

void Header::take_quantity(const std::string& quantity, const std::string& column, const std::string& unit) {
  const bool joint = is_joint(quantity);
  const Units& expected = !joint && !is_angle(quantity) ? lengths_in_mm : angles_in_rad;
  if (unit.empty()) {
    refuse(fmt::format("column \"{}\" has no unit: write {}{}", column, spellings(quantity, expected),
                       joint ? fmt::format(" (a prismatic joint: {})", spellings(quantity, lengths_in_mm)) : ""));
  }
  const auto [before, is_new] = quantities_.try_emplace(quantity, Quantity{column, unit});
  if (!is_new) refuse(fmt::format("columns \"{}\" and \"{}\" are the same quantity", before->second.column, column));
  if (!expected.contains(unit) && !(joint && lengths_in_mm.contains(unit))) {
    refuse(
        fmt::format("column \"{}\": unit \"{}\" is not known: write {}", column, unit, spellings(quantity, expected)));
  }
  if (joint || is_angle(quantity) || quantity == "distance" || quantity == "radius") return;
  const std::string target = target_of(quantity);
  if (std::ranges::find(targets_, target) == targets_.end()) targets_.push_back(target);
}

double Header::factor(const std::string& name, const Units& units) const {
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
  std::vector<Eigen::Index> read;
  Eigen::RowVectorXd factors = Eigen::RowVectorXd::Ones(std::ssize(joints));
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::string name = fmt::format("q{}", j + 1);
    const Units& units = joints[j].type == JointType::revolute ? angles_in_rad : lengths_in_mm;
    if (!quantities_.contains(name) && joints[j].mimic) continue;
    if (!quantities_.contains(name)) {
      const std::string& own = joints[j].name;
      if (csv_.has(own)) {
        refuse(fmt::format("column \"{0}\" has no unit: name it {0}_deg or {0}_rad, here or in a column map", own));
      }
      const bool is_named = csv_.columns().front().find_first_not_of("0123456789.,+-eE") != std::string::npos;
      refuse(fmt::format("robot \"{}\" has {} joints, there is no column {} for {}; columns: {}{}", robot_.chain.name,
                         joints.size(), spellings(name, units), joints[j].name, csv_row(csv_.columns()),
                         is_named ? "" : "; the first line must hold the names of the columns"));
    }
    factors(j) = factor(name, units);
    read.push_back(static_cast<Eigen::Index>(j));
    columns.push_back(quantities_.at(name).column);
  }
  for (const auto& [name, quantity] : quantities_) {
    if (is_joint(name) && std::ranges::find(columns, quantity.column) == columns.end()) {
      refuse(
          fmt::format("column \"{}\": robot \"{}\" has {} joints", quantity.column, robot_.chain.name, joints.size()));
    }
  }
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(csv_.rows(), std::ssize(joints));
  values(Eigen::all, read) = csv_.numbers(columns);
  values.array().rowwise() *= factors.array();
  Eigen::MatrixXd all = with_mimics(robot_.chain, values);
  for (const Eigen::Index j : read) {
    if (!joints[j].mimic) continue;
    constexpr double most = 1.0;  // degree or mm: what is read back may differ a little
    const double off = (all.col(j) - values.col(j)).cwiseAbs().maxCoeff() * to_limit_unit(joints[j]);
    if (!(off > most)) continue;
    refuse(
        fmt::format("column \"{}\": {} mimics {}, and the column is up to {:.3g} {} off what it should then be; leave "
                    "it out, or correct the description",
                    quantities_.at(fmt::format("q{}", j + 1)).column, joints[j].name, joints[j].mimic->joint, off,
                    limit_unit(joints[j])));
  }
  all(Eigen::all, read) = values(Eigen::all, read);
  return all;
}

std::vector<JointColumn> Header::joint_columns() const {
  std::vector<JointColumn> columns;
  for (std::size_t j = 0; j < robot_.chain.joints.size(); ++j) {
    const auto found = quantities_.find(fmt::format("q{}", j + 1));
    columns.push_back(found == quantities_.end() ? JointColumn{}
                                                 : JointColumn{found->second.column, found->second.unit});
  }
  return columns;
}

Eigen::MatrixXd Header::points_mm(const std::string& target, std::array<bool, 3>& measured) const {
  Eigen::MatrixXd points = Eigen::MatrixXd::Zero(csv_.rows(), 3);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name = target + "xyz"[axis];
    measured[axis] = quantities_.contains(name);
    if (!measured[axis]) continue;
    const std::string& column = quantities_.at(name).column;
    const double to_mm = factor(name, lengths_in_mm);
    const Eigen::VectorXd values = target.empty() && !words_.contains("socket")
                                       ? csv_.numbers(column)
                                       : csv_.numbers_or_missing(std::vector<std::string>{column}).col(0).eval();
    points.col(axis) = to_mm * values;
    for (Eigen::Index row = 0; row < points.rows(); ++row) {
      if (!(std::abs(points(row, axis)) > farthest_mm)) continue;
      throw std::runtime_error(fmt::format("{}:{}: column \"{}\": {} mm, at most {:g} mm are possible", csv_.name(),
                                           csv_.line_of(row), column, points(row, axis), farthest_mm));
    }
  }
  return points;
}

Eigen::VectorXd Header::lengths_mm(const std::string& quantity) const {
  if (!has(quantity)) return {};
  const std::string& column = quantities_.at(quantity).column;
  // Beside sockets a row may have none.
  const bool may_lack = words_.contains("socket");
  const Eigen::VectorXd values =
      factor(quantity, lengths_in_mm) *
      (may_lack ? csv_.numbers_or_missing(std::vector<std::string>{column}).col(0).eval() : csv_.numbers(column));
  for (Eigen::Index row = 0; row < values.size(); ++row) {
    if ((values(row) > 0.0 && values(row) <= farthest_mm) || (may_lack && std::isnan(values(row)))) continue;
    csv_.refuse(row, column, fmt::format("a {} must be above 0", quantity));
  }
  return values;
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
    std::vector<std::string> columns;
    for (const std::string& name : quaternion) columns.push_back(quantities_.at(name).column);
    orientation.values = csv_.numbers(columns);
    for (Eigen::Index row = 0; row < csv_.rows(); ++row) {
      if (!(orientation.values.row(row).norm() > 0.0)) csv_.refuse(row, columns[0], "the quaternion has length 0");
    }
  }
  return orientation;
}

// Angles that the controller read back are kept in rad like the joint values.
std::map<std::string, Eigen::VectorXd> Header::covariates() const {
  // One kind may hold for all axes and the other for one of them, but not both for the same.
  const auto column_of = [&](const std::string& quantity) {
    const auto found = std::ranges::find_if(covariates_, [&](const auto& entry) {
      return entry.first == quantity + "_um" || entry.first == quantity + "_mm";
    });
    return found == covariates_.end() ? std::string() : found->second;
  };
  for (const std::string axis : {"", "_x", "_y", "_z"}) {
    const std::string sigma = column_of("sigma" + axis);
    const std::string expanded = column_of("U95" + axis);
    if (!sigma.empty() && !expanded.empty()) {
      refuse(fmt::format("columns \"{}\" and \"{}\" both state the noise: keep one of the two", sigma, expanded));
    }
  }
  std::map<std::string, Eigen::VectorXd> values;
  for (const auto& [own, column] : covariates_) {
    const bool in_degrees = own.starts_with("qmeas") && own.ends_with("_deg");
    const std::string name = in_degrees ? own.substr(0, own.size() - 4) + "_rad" : own;
    const auto [entry, is_new] = values.try_emplace(name, (in_degrees ? radians : 1.0) * csv_.numbers(column));
    if (!is_new) refuse(fmt::format("column \"{}\" is the same quantity as another one in rad", column));
    if (!own.starts_with("sigma") && !own.starts_with("U95")) continue;
    for (Eigen::Index row = 0; row < csv_.rows(); ++row) {
      if (!(entry->second(row) > 0.0)) {
        csv_.refuse(row, column, fmt::format("a standard deviation must be above 0, is {}", entry->second(row)));
      }
    }
  }
  return values;
}

std::vector<std::string> Header::words(const std::string& column) const {
  const auto found = words_.find(column);
  return found == words_.end() ? std::vector<std::string>{} : csv_.texts(found->second);
}

std::string Header::sequence_column() const {
  for (const char* name : {"order", "time_s"}) {
    const auto found = covariates_.find(name);
    if (found != covariates_.end()) return found->second;
  }
  return {};
}

}  // namespace llmt::robotics
