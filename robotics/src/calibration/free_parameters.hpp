// The parameters of a robot that a calibration may free.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "llmt/robotics/calibration_options.hpp"
#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

/// "joint2" of the parameter "joint2.a".
std::string owner_of(const std::string& name);

/// Per parameter of parameters(robot): empty if it may be free, else why it is fixed. Options and convention only, no
/// data.
std::vector<std::string> reasons_to_fix(const Robot& robot, const CalibrationOptions& options);

/// Adds a reason to rotations of the first joint that turning base and sockets does as well. Such a turn keeps the
/// lengths of the residuals but changes their coordinates, so fix_dependent() does not see it.
void fix_what_sockets_take_up(const Robot& robot, const Poses& poses, std::vector<std::string>& reasons);

/// If all readings are of sockets, planes and spheres, an arm and touched things twice as large fit as well: adds a
/// reason to the longest length of a joint that is still free, unless a length is known by the options, the radius of a
/// sphere is given, or a joint slides.
void keep_scale(const Robot& robot, const Poses& poses, const CalibrationOptions& options,
                std::vector<std::string>& reasons);

/// Names of the parameters that the robot's calibration kept for one of these reasons.
std::set<std::string> unseen_by_touch(const Robot& robot);

/// Numbers, among parameters(robot), of those that the robot's calibration freed, identifiable or not; ascending.
std::vector<Eigen::Index> freed_parameters(const Robot& robot);

/// Adds the reasons the data give: in order, every parameter whose column of `jacobian` depends on the columns of free
/// parameters before it but for a share of its norm: `geometric_tolerance` for the first `geometric` parameters, a
/// thousandth at least for those of effects. Columns are compared in parameter scales.
void fix_dependent(const std::vector<discovery::Parameter>& parameters, const Eigen::MatrixXd& jacobian,
                   Eigen::Index geometric, double geometric_tolerance, std::vector<std::string>& reasons);

/// Gives the first `geometric` parameters the weak priors of the options around their values: base and tool have ten
/// times the standard deviations of joints; and all parameters those that the options name.
void set_priors(std::vector<discovery::Parameter>& parameters, Eigen::Index geometric,
                const CalibrationOptions& options);

/// True if the joint's beta replaces its d: the axes that its alpha and beta connect are within `limit_deg` of
/// (anti)parallel.
bool is_nearly_parallel(const Chain& chain, std::size_t joint, double limit_deg);

}  // namespace llmt::robotics
