/// \file
/// What a robot model consists of, and the poses that it is evaluated at.
///
///     Poses poses;
///     poses.joints = Eigen::MatrixXd::Zero(10, 6);  // rad
///     poses.covariates["payload_kg"] = Eigen::VectorXd::Constant(10, 2.0);
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/robotics/effect_type.hpp"
#include "llmt/robotics/urdf.hpp"

namespace llmt::robotics {

/// What calibration found out about one parameter; the value itself stands in the chain or the effect.
struct IdentifiedParameter {
  std::string name;
  std::optional<double> standard_error;  ///< in the parameter's unit; empty if it was not identified
  std::string state;                     ///< "free", or why it was fixed
};

/// A file that a calibration was made from.
struct SourceFile {
  std::string role;    ///< description, measurements, test
  std::string name;    ///< without folders
  std::string sha256;  ///< of its bytes, 64 hexadecimal digits
};

/// Where a calibrated description comes from, for those who audit it. Nothing is computed from it.
struct Provenance {
  std::string program;  ///< with its version
  std::string date;     ///< in UTC, as 2026-05-31
  std::vector<SourceFile> sources;
  std::vector<std::string> options;  ///< of the command line, as they were given
  std::string instrument = {};       ///< as the user states it; empty: nobody did
  std::string serial_number = {};    ///< of the robot, likewise
};

/// How good a calibration was, for whoever asks later whether it still holds.
struct CalibrationRecord {
  Eigen::Index poses = 0;                ///< that it was made from
  Eigen::Index coordinates = 0;          ///< that were measured at them, of points, orientations and distances
  double noise_mm = 0.0;                 ///< of the residuals of points: root mean square of a coordinate
  std::optional<double> held_out_mm;     ///< mean error on poses that took no part
  std::optional<double> held_out_sd_mm;  ///< standard deviation of these errors
  Eigen::Index held_out_poses = 0;       ///< the number of these errors; 0: that of the poses
  std::vector<std::array<double, 2>> joint_ranges;  ///< J, that the poses had; deg or mm as limits; empty: not known
  /// Smallest and largest value of what the readings were taken under: payload_kg, temp_C.
  std::map<std::string, std::array<double, 2>> condition_ranges = {};
  std::optional<Provenance> made_from = {};
  /// L x L, of the identified parameters that have a standard error, in their order.
  Eigen::MatrixXd correlations;
};

/// A chain, the effects on top of it, and what is known about both.
struct Robot {
  Chain chain;
  std::vector<Effect> effects;
  std::vector<IdentifiedParameter> identified;        ///< empty before calibration
  std::optional<CalibrationRecord> calibration = {};  ///< of the values identified
  std::string correction_file;                        ///< model file of the residual correction, or empty
  UrdfLinks urdf_links = {};                          ///< given when the arm was taken from a URDF
};

/// Which three coordinates an instrument reads of an arm.
enum class Reading {
  position,     ///< x, y, z of the tool point in the world frame, mm
  orientation,  ///< lever times the rotation vector from `reference` to the tool's orientation, in the world frame, mm
  /// Distance of the tool point from the origin of the world frame, mm, less NamedFrame::radius_mm if the base is a
  /// sphere of unknown radius; then two zeros.
  distance,
};

/// What one row of poses is a reading of.
struct Observation {
  std::string base = {};  ///< name among Chain::bases, or empty: Chain::base
  std::string tool = {};  ///< name among Chain::tools, or empty: Chain::tool
  Reading reading = Reading::position;
  double lever_mm = 1000.0;                                 ///< of an orientation: this length stands for one rad
  Eigen::Matrix3d reference = Eigen::Matrix3d::Identity();  ///< of an orientation
  Eigen::Index stand = 0;  ///< rows with equal numbers were read while the arm stood still once
};

/// Where the arm stood, under which conditions, and what was looked at: one row a reading.
struct Poses {
  Eigen::MatrixXd joints;                             ///< n x J: rad, mm for prismatic joints
  std::map<std::string, Eigen::VectorXd> covariates;  ///< by column name, e.g. "payload_kg", n values each
  std::vector<Observation> observations = {};         ///< n, or none: every row is the position of Chain::tool

  Eigen::Index count() const { return joints.rows(); }
};

/// The poses of the given rows.
Poses select(const Poses& poses, const std::vector<Eigen::Index>& rows);

/// Whether any of the poses was read by an instrument: not all are of what the tool touches, see is_touched().
bool has_instrument(const Poses& poses);

}  // namespace llmt::robotics
