// The columns of a table of measurements, sorted into what they mean.
#pragma once

#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/robotics/measurements.hpp"

namespace llmt::robotics {

/// The map without the columns that a table of poses or targets lacks: it was written for measurements, which have
/// more. A joint that is missing is refused by Header::joints().
ColumnMap for_columns_of(const Csv& csv, ColumnMap map);

class Header {
 public:
  /// `also`: columns that are covariates besides those known by name. Throws std::runtime_error `path:1: ...` if a
  /// column has no unit or one that does not suit, or two are the same quantity.
  Header(const Csv& csv, const Robot& robot, const std::vector<std::string>& also, const ColumnMap& map = {});

  bool has(const std::string& quantity) const { return quantities_.contains(quantity); }
  bool has_plane() const { return words_.contains("plane"); }
  bool has_sphere() const { return words_.contains("sphere"); }
  bool has_joints() const { return quantities_.lower_bound("q0") != quantities_.lower_bound("q:"); }  // q1, q2, ...

  /// n x J in rad and mm. Joints that mimic others need no column.
  Eigen::MatrixXd joints() const;

  /// Joint by joint.
  std::vector<JointColumn> joint_columns() const;

  /// Prefixes of the columns of targets, in the order of the columns: "" for x_mm, "t2_" for t2_x_mm.
  const std::vector<std::string>& targets() const { return targets_; }

  /// n x 3 in mm, NaN where the cell is empty (allowed for several targets, and beside sockets) and zero where there is
  /// no column.
  Eigen::MatrixXd points_mm(const std::string& target, std::array<bool, 3>& measured) const;

  /// The column `distance`, or `radius` beside a column of spheres; above 0, or NaN where the cell is empty in a table
  /// that has a column of sockets. Empty if there is no such column.
  Eigen::VectorXd distances_mm() const { return lengths_mm("distance"); }
  Eigen::VectorXd radii_mm() const { return lengths_mm("radius"); }

  Orientation orientation() const;
  std::map<std::string, Eigen::VectorXd> covariates() const;

  /// The column of the file that says in which sequence rows were read: order, or else time_s; empty if there is none.
  std::string sequence_column() const;

  /// Names in the column `target`, `session`, `socket`, `plane`, `sphere`, `reference` or `from`, row by row; empty if
  /// there is none.
  std::vector<std::string> words(const std::string& column) const;

  const std::vector<std::string>& unused() const { return unused_; }

  /// Sentences on what the columns that are not used look like.
  std::vector<Finding> hints() const;

  /// The reason why the columns of an orientation are none, in words; empty if they are one.
  std::string lack_of_orientation() const;

 private:
  struct Quantity {
    std::string column;
    std::string unit;
  };

  const Csv& csv_;
  const Robot& robot_;
  std::set<std::string> also_;
  std::map<std::string, Quantity> quantities_;     // "q1", "x", "t2_x", "rx", "qw", "distance" -> column, unit
  std::map<std::string, std::string> covariates_;  // name -> column
  std::map<std::string, std::string> words_;       // "target", "socket", "plane", ... -> column
  std::vector<std::string> targets_;
  std::vector<std::string> unused_;
  bool has_named_joints_ = false;  // every joint has a column by its name
  bool has_radii_ = false;         // whether `radius` has a meaning: beside a column of spheres

  [[noreturn]] void refuse(const std::string& message) const;
  void look_for_named_joints(const std::set<std::string>& names);
  bool take_named_joint(const std::string& name, const std::string& column);
  void take(const std::string& name, const std::string& column);
  void take_quantity(const std::string& quantity, const std::string& column, const std::string& unit);
  Eigen::VectorXd lengths_mm(const std::string& quantity) const;
  double factor(const std::string& quantity, const std::map<std::string, double>& units) const;
};

}  // namespace llmt::robotics
