/// \file
/// Measured poses of a robot, and the CSV files that hold them.
///
///     const Measurements measured = read_measurements("measured.csv", robot);
///     const Eigen::VectorXd errors_mm = distances(positions(robot, measured.poses), measured);
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/csv.hpp"
#include "llmt/finding.hpp"
#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

/// Orientation of the tool as it stands in the file. It takes part in calibration and discovery after
/// with_orientations().
struct Orientation {
  enum class Kind { angles_deg, quaternion };
  Kind kind = Kind::angles_deg;
  Eigen::MatrixXd values;       ///< n x 3: rx, ry, rz in degrees; or n x 4: w, x, y, z
  std::string convention = {};  ///< of the angles, e.g. "intrinsic_xyz"; empty: that of the chain
};

/// n readings of an instrument.
struct Measurements {
  Poses poses;
  Eigen::MatrixXd positions_mm;                       ///< n x 3, see Reading; columns that were not measured hold zeros
  std::array<bool, 3> measured = {true, true, true};  ///< which of x, y, z were measured
  Orientation orientation;                            ///< empty values if there is none
  std::string session;                                ///< that the chain's own base stands for; empty: none was named
  std::string target;                                 ///< that the chain's own tool stands for; empty: none was named
  std::vector<Eigen::Index> lines;                    ///< of the file, row by row; empty without a file
  std::vector<std::string> unused_columns;            ///< columns of the file that are not used
  std::vector<Finding> warnings;                      ///< for people, e.g. rows left out because the point is missing

  Eigen::Index count() const { return poses.count(); }
};

/// The given rows; warnings and unused columns are not carried over.
Measurements select(const Measurements& measurements, const std::vector<Eigen::Index>& rows);

/// All but the given rows.
Measurements without_rows(const Measurements& measurements, const std::vector<std::size_t>& left_out);

/// The measurements without sessions, sockets, planes and spheres that have no more measured coordinates than there are
/// numbers to find of them: they say nothing of the arm, and cannot be judged. These numbers are six of a session, four
/// of a sphere of unknown radius, three of anything else that is touched, and three of every tool that is seen there
/// alone. A warning names them and their lines. A file of one session stays as it is.
Measurements without_small_sessions(const Measurements& measurements);

/// Throws std::invalid_argument if shapes differ, a number is not finite, no row or no coordinate was measured, or the
/// number of joints is not that of the robot.
void validate(const Measurements& measurements, const Robot& robot);

/// The measurements with their orientations as further rows, in the order of the positions, one for the targets of a
/// pose that have the same; each is a reading of how the tool of its row is turned. The convention of angles is that of
/// the chain. Throws std::invalid_argument if there are none, not all of x, y, z were measured, or readings are not of
/// positions.
Measurements with_orientations(const Measurements& measurements, const Chain& chain);

/// The robot with a base and a tool of every name among the observations; those that it does not have begin as its own
/// base and tool. Of measurements it takes also the names of its own base and tool, where it has none yet.
Robot with_frames(Robot robot, const Poses& poses);
Robot with_frames(Robot robot, const Measurements& measurements);

/// Rows that are readings of an orientation, and all others; ascending.
std::vector<Eigen::Index> orientation_rows(const Poses& poses);
std::vector<Eigen::Index> position_rows(const Poses& poses);

/// Numbers of sweeps, one per row, where most steps from row to row move one joint alone: rows that follow each other
/// while the same joint moves. Empty: the poses are no sweeps, or fewer than five.
std::vector<double> sweeps_of(const Poses& poses);

/// Numbers of 25 stretches, one per row, where poses follow each other along a path: the median step from row to row is
/// at most a tenth of the median distance between rows anywhere in the table, each joint in units of its spread. Empty:
/// it is no path, or there are fewer than 50 rows.
std::vector<double> path_of(const Poses& poses);

/// One number per row, equal where rows belong together and must not be torn apart: sweeps_of(), path_of(), the column
/// `pose`, or else Observation::stand. Empty: every row is a pose of its own.
std::vector<double> pose_labels(const Poses& poses);

/// The mean of readings of one kind and one tool; of orientations relative to the reference of the first row.
Eigen::RowVector3d mean_reading(const Measurements& measurements, const std::vector<Eigen::Index>& rows);

/// Stated standard deviations of the measured coordinates, mm, n x 3: from the columns sigma_x_um, sigma_y_um,
/// sigma_z_um (or _mm), or sigma_um for all three; or half of the expanded uncertainty U95_x_um, ..., U95_um. Zero
/// where nothing is stated.
Eigen::MatrixXd stated_sigma_mm(const Measurements& measurements);

/// Which of the 3n stacked coordinates x, y, z of pose 0, x, y, z of pose 1, ... were measured: their numbers,
/// ascending.
std::vector<Eigen::Index> measured_rows(const Measurements& measurements);

/// Distances between model and measurement over the measured coordinates, n values, mm.
Eigen::VectorXd distances(const Eigen::MatrixXd& model_mm, const Measurements& measurements);

/// What the columns of a file that was not written for this project mean.
struct ColumnMap {
  std::map<std::string, std::string> names = {};  ///< name in the file -> name as for read_measurements(), with unit
  std::optional<DecimalMark> decimal = {};
  std::string orientation = {};  ///< convention of rx, ry, rz; empty: that of the robot's description
};

/// Reads a column map: YAML with `columns`, a map of names, and optionally `decimal`, comma or point, and
/// `orientation`, see is_orientation().
///
///     decimal: comma
///     columns: {shoulder: q1_rad, "Measured x": x_mm}
///
/// Throws std::runtime_error starting with `path:line`.
ColumnMap read_column_map(const std::string& path);
ColumnMap parse_column_map(const std::string& text, const std::string& name);

/// Reads measurements for a robot. Columns, with the unit as suffix:
///
///   q1_deg, q1_rad (revolute), q3_mm, q3_m (prismatic)   every joint, all from 1 on
///   NAME_deg, NAME_rad, NAME_mm, NAME_m                  the same by the joints' names in the description
///   x_mm, y_mm, z_mm (also _m, _um)                      at least one
///   rx_deg ry_deg rz_deg (also _rad), or qw qx qy qz     orientation, optional
///   t1_x_mm t1_y_mm t1_z_mm t2_x_mm ...                  several targets in one pose; a cell may be empty
///   target, session                                      names: of what was looked at, of how the instrument stood
///   socket                                               name of what the tool's ball lies in, instead of positions
///   from distance_mm                                     beside it: a certified length from another socket to this one
///   plane                                                name of a flat surface that the tool point lies on, likewise
///   sphere                                               name of a ball that the tool point lies on, likewise
///   radius_mm (also _m, _um)                             of that sphere, at the tool point; optional
///   reference                                            name of a point that stands still and is read in this row
///   distance_mm (also _m, _um)                           instead of positions: distance from a fixed point
///   payload_kg temp_C time_s order pose dirN tauN_Nm qmeasN_deg sigma_x_um U95_x_um ...   covariates, optional
///
/// The fixed point of distances is the origin of the world frame. The session and the target that the chain names as
/// its own, or else the first ones, have its own base and tool; the others have frames of their names, which
/// with_frames() adds. In another session the tool is another one, too: "SESSION", or "SESSION/TARGET".
///
/// The centre of a socket is the origin of the base "socket NAME", see is_socket(); a plane is that of x and y of the
/// base "plane NAME", and z = 0 is what was measured. The centre of a sphere is the origin of the base "sphere NAME",
/// see is_sphere(), or of "known sphere NAME" with its radius: the distance from it is what was measured, less the
/// radius of the base or equal to the one given. Readings of reference points are no rows of the result: the movement
/// of the instrument that they show is taken off the others, see docs/file-formats.md.
///
/// Covariates keep their names, but qmeasN_deg becomes qmeasN_rad. Columns named in `also`, or in a formula among the
/// robot's effects, are covariates too. With order or time_s, add_moves() is called.
/// A joint, position or angle column without a unit is an error that says so. Rows whose measured coordinates are all
/// exactly zero are missing points written as zeros: left out, with a warning naming the lines. Other columns are
/// listed, not used. `mark`: of the numbers. Throws std::runtime_error starting with `path` or `path:line`.
Measurements read_measurements(const std::string& path, const Robot& robot, const std::vector<std::string>& also = {},
                               DecimalMark mark = DecimalMark::point, const ColumnMap& map = {});

/// As read_measurements(), from memory; `name` stands for the path in messages.
Measurements parse_measurements(std::string text, const std::string& name, const Robot& robot,
                                const std::vector<std::string>& also = {}, DecimalMark mark = DecimalMark::point,
                                const ColumnMap& map = {});

/// The column of a joint in a file, both empty where a joint that mimics another has none.
struct JointColumn {
  std::string name;
  std::string unit;  ///< "rad", "deg", "mm", "m" or "um"
};

/// The columns of joint values in a table for people and controllers, in degrees or mm: "shoulder_pan_joint_deg", by
/// the names of the joints; "q1_deg", by their numbers, where a name means something else in such a table ("x", "q3").
std::vector<JointColumn> joint_columns(const Chain& chain);

/// Joint values from rad or mm to the unit of a column. Where they change they are rounded to 15 digits, so that 10.5
/// degrees that were read are 10.5 again. Throws std::invalid_argument if there is no such unit.
Eigen::VectorXd in_unit_of(const JointColumn& column, const Eigen::VectorXd& values);

/// Poses, and where their joint values stood.
struct PoseTable {
  Poses poses;
  std::vector<JointColumn> joint_columns;
};

/// The joint values and covariates of such a file, which may have no measured positions: one row for each stand of the
/// arm. Columns of the map that the file lacks do not matter.
Poses read_poses(const std::string& path, const Robot& robot, DecimalMark mark = DecimalMark::point,
                 const ColumnMap& map = {});
/// Every row, with the frames of its session and target where the robot has these by name. Throws std::runtime_error,
/// naming the line, for one that it does not have.
PoseTable read_pose_table(const std::string& path, const Robot& robot, DecimalMark mark = DecimalMark::point,
                          const ColumnMap& map = {});

/// As read_pose_table(), from memory; `name` stands for the path in messages.
PoseTable parse_pose_table(std::string text, const std::string& name, const Robot& robot,
                           DecimalMark mark = DecimalMark::point, const ColumnMap& map = {});

/// What a file asks a robot for, row by row.
struct TargetTable {
  Eigen::MatrixXd joints;                  ///< n x J as in Poses, or empty if the file has no joint columns
  std::vector<JointColumn> joint_columns;  ///< J, or none
  Eigen::MatrixXd positions_mm;            ///< n x 3, or empty
  Orientation orientation;                 ///< with its convention; empty values if there is none
  std::map<std::string, Eigen::VectorXd> covariates;
  std::vector<std::string> unused_columns;
  std::vector<Eigen::Index> lines;  ///< of the file, for messages
  Observation frames = {};          ///< base and tool of the session and target that all rows name

  Eigen::Index count() const { return std::ssize(lines); }
};

/// Reads targets: columns as for read_measurements(), but either joints or positions may be absent; positions need all
/// of x, y and z. Columns of the map that the file lacks do not matter. Sessions and targets that the robot has by name
/// must be the same in all rows. Throws as read_measurements().
TargetTable read_targets(const std::string& path, const Robot& robot, DecimalMark mark = DecimalMark::point,
                         const ColumnMap& map = {});

/// As read_targets(), from memory; `name` stands for the path in messages.
TargetTable parse_targets(std::string text, const std::string& name, const Robot& robot,
                          DecimalMark mark = DecimalMark::point, const ColumnMap& map = {});

/// Adds how far each joint moved to reach a pose: columns move1_rad (_mm if prismatic), ..., differences of joint
/// values to the row before in the sequence of the column order, or else time_s; 0 in the first row. Nothing without
/// either.
void add_moves(Poses& poses, const Chain& chain);

/// Whether a column is one that add_moves() adds.
bool is_move(std::string_view column);

/// The CSV text that reads back exactly: q in rad or mm, positions in mm, then the covariates, but not what
/// add_moves() added. Orientation is written if there is one. Joint values stand in columns q1_rad, ..., or in those
/// that are given, one for each joint; a joint whose column has no name is left out.
std::string to_csv(const Measurements& measurements, const Robot& robot,
                   const std::vector<JointColumn>& joint_columns = {});

/// A name as the field of a table: quoted (RFC 4180) if it has a separator, a quote or a line break.
std::string csv_field(const std::string& name);

}  // namespace llmt::robotics
