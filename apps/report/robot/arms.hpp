/// \file
/// Pictures of an arm, its poses and its errors.
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/correction.hpp"
#include "llmt/robotics/measurements.hpp"
#include "report/document/document.hpp"

namespace llmt::report {

/// measured - model in the world frame, n x 3, mm; 0 where a coordinate was not measured.
Eigen::MatrixXd errors_at(const Eigen::MatrixXd& model_mm, const robotics::Measurements& measured);

/// A round number by which errors have to be multiplied to be seen beside the arm.
double arrow_scale(const Eigen::MatrixXd& errors_mm, const robotics::Measurements& measured);

/// The arm in a middle pose, the measured points, and at each the error times `scale`. At most 400 of them.
Arm arm_picture(const std::string& title, const robotics::Robot& robot, const robotics::Measurements& measured,
                const Eigen::MatrixXd& errors_mm, double scale, const std::string& role);

/// Columns of errors: of one pose after the other, in the order of the file.
Chart error_per_pose(const std::vector<std::pair<std::string, Eigen::VectorXd>>& stages,
                     const std::vector<std::string>& roles);

/// The part of errors that a joint's motion makes, mm: the projection of each on the direction in which the joint moves
/// the tool, n values.
Eigen::VectorXd along_joint(const robotics::Robot& robot, const robotics::Measurements& measured,
                            const Eigen::MatrixXd& errors_mm, Eigen::Index joint);

/// Joint values as people read them: degrees, or mm.
Numbers joint_values(const robotics::Chain& chain, const Eigen::MatrixXd& joints, Eigen::Index joint);
std::string joint_axis(const robotics::Chain& chain, Eigen::Index joint);

/// How often each part of every joint's range was measured; "where the joints were and were not".
Map coverage(const robotics::Chain& chain, const Eigen::MatrixXd& joints);

}  // namespace llmt::report
