/// \file
/// What a robot model consists of, and the poses that it is evaluated at.
///
///     Poses poses;
///     poses.joints = Eigen::MatrixXd::Zero(10, 6);  // rad
///     poses.covariates["payload_kg"] = Eigen::VectorXd::Constant(10, 2.0);
#pragma once

#include <Eigen/Core>
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

/// A chain, the effects on top of it, and what is known about both.
struct Robot {
  Chain chain;
  std::vector<Effect> effects;
  std::vector<IdentifiedParameter> identified;  ///< empty before calibration
  std::string correction_file;                  ///< model file of the residual correction, or empty
  UrdfLinks urdf_links = {};                    ///< given when the arm was taken from a URDF
};

/// Where the arm stood and under which conditions: one row a pose.
struct Poses {
  Eigen::MatrixXd joints;                             ///< n x J: rad, mm for prismatic joints
  std::map<std::string, Eigen::VectorXd> covariates;  ///< by column name, e.g. "payload_kg", n values each

  Eigen::Index count() const { return joints.rows(); }
};

}  // namespace llmt::robotics
