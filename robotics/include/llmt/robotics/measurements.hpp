/// \file
/// Measured poses of a robot, and the CSV files that hold them.
///
///     const Measurements measured = read_measurements("measured.csv", robot);
///     const Eigen::VectorXd errors_mm = distances(positions(robot, measured.poses), measured);
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/csv.hpp"
#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

/// Orientation of the tool as it stands in the file; kept, not used for calibration yet.
struct Orientation {
  enum class Kind { angles_deg, quaternion };
  Kind kind = Kind::angles_deg;
  Eigen::MatrixXd values;  ///< n x 3: rx, ry, rz in degrees; or n x 4: w, x, y, z
};

/// n poses and the measured tool positions.
struct Measurements {
  Poses poses;
  Eigen::MatrixXd positions_mm;                       ///< n x 3, world frame; columns that were not measured hold zeros
  std::array<bool, 3> measured = {true, true, true};  ///< which of x, y, z were measured
  Orientation orientation;                            ///< empty values if there is none
  std::vector<std::string> unused_columns;            ///< columns of the file that are not used
  std::vector<std::string> warnings;                  ///< for people, e.g. rows left out because the point is missing

  Eigen::Index count() const { return poses.count(); }
};

/// The given rows; warnings and unused columns are not carried over.
Measurements select(const Measurements& measurements, const std::vector<Eigen::Index>& rows);

/// Throws std::invalid_argument if shapes differ, a number is not finite, no row or no coordinate was measured, or the
/// number of joints is not that of the robot.
void validate(const Measurements& measurements, const Robot& robot);

/// Which of the 3n stacked coordinates x, y, z of pose 0, x, y, z of pose 1, ... were measured: their numbers,
/// ascending.
std::vector<Eigen::Index> measured_rows(const Measurements& measurements);

/// Distances between model and measurement over the measured coordinates, n values, mm.
Eigen::VectorXd distances(const Eigen::MatrixXd& model_mm, const Measurements& measurements);

/// Reads measurements for a robot. Columns, with the unit as suffix:
///
///   q1_deg, q1_rad (revolute), q3_mm, q3_m (prismatic)   every joint, all from 1 on
///   NAME_deg, NAME_rad, NAME_mm, NAME_m                  the same by the joints' names in the description
///   x_mm, y_mm, z_mm (also _m, _um)                      at least one
///   rx_deg ry_deg rz_deg (also _rad), or qw qx qy qz     orientation, optional
///   payload_kg temp_C time_s order pose dirN tauN_Nm qmeasN_deg sigma_x_um ...   covariates, optional
///
/// Covariates keep their names, but qmeasN_deg becomes qmeasN_rad. Columns named in `also`, or in a formula among the
/// robot's effects, are covariates too. With order or time_s, add_moves() is called.
/// A joint, position or angle column without a unit is an error that says so. Rows whose measured coordinates are all
/// exactly zero are missing points written as zeros: left out, with a warning naming the lines. Other columns are
/// listed, not used. `mark`: of the numbers. Throws std::runtime_error starting with `path` or `path:line`.
Measurements read_measurements(const std::string& path, const Robot& robot, const std::vector<std::string>& also = {},
                               DecimalMark mark = DecimalMark::point);

/// As read_measurements(), from memory; `name` stands for the path in messages.
Measurements parse_measurements(std::string text, const std::string& name, const Robot& robot,
                                const std::vector<std::string>& also = {}, DecimalMark mark = DecimalMark::point);

/// The joint values and covariates of such a file, which may have no measured positions.
Poses read_poses(const std::string& path, const Robot& robot, DecimalMark mark = DecimalMark::point);

/// What a file asks a robot for, row by row.
struct TargetTable {
  Eigen::MatrixXd joints;         ///< n x J as in Poses, or empty if the file has no joint columns
  bool joints_in_degrees = true;  ///< how the file writes revolute joints
  Eigen::MatrixXd positions_mm;   ///< n x 3, or empty
  Orientation orientation;        ///< empty values if there is none
  std::map<std::string, Eigen::VectorXd> covariates;
  std::vector<std::string> unused_columns;
  std::vector<Eigen::Index> lines;  ///< of the file, for messages

  Eigen::Index count() const { return std::ssize(lines); }
};

/// Reads targets: columns as for read_measurements(), but either joints or positions may be absent; positions need all
/// of x, y and z. Throws as read_measurements().
TargetTable read_targets(const std::string& path, const Robot& robot, DecimalMark mark = DecimalMark::point);

/// Adds how far each joint moved to reach a pose: columns move1_rad (_mm if prismatic), ..., differences of joint
/// values to the row before in the sequence of the column order, or else time_s; 0 in the first row. Nothing without
/// either.
void add_moves(Poses& poses, const Chain& chain);

/// Whether a column is one that add_moves() adds.
bool is_move(std::string_view column);

/// The CSV text that reads back exactly: q in rad or mm, positions in mm, then the covariates, but not what
/// add_moves() added. Orientation is written if there is one.
std::string to_csv(const Measurements& measurements, const Robot& robot);

}  // namespace llmt::robotics
