#include "pose_selection/pose_model.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/free_parameters.hpp"
#include "llmt/robotics/effects.hpp"
#include "robot/robot_evaluator.hpp"

namespace llmt::robotics {

PoseModel::PoseModel(const Robot& robot, const Poses& basis, const std::vector<const Poses*>& also,
                     const CalibrationOptions& options)
    : robot_(robot) {
  std::erase_if(robot_.effects, [&](const Effect& effect) {
    const auto lacks = [&](const Poses& poses) {
      return std::ranges::any_of(effect_columns(robot.chain, effect),
                                 [&](const std::string& names) { return find_column(poses, names) == nullptr; });
    };
    const bool is_left_out =
        lacks(basis) || std::ranges::any_of(also, [&](const Poses* poses) { return lacks(*poses); });
    if (is_left_out) left_out_.push_back(effect_label(effect));
    return is_left_out;
  });
  std::vector<discovery::Parameter> all = robotics::parameters(robot_);
  std::vector<std::string> reasons = reasons_to_fix(robot_, options);
  const Eigen::Index geometric = geometric_parameter_count(robot_.chain);
  Eigen::Index next = geometric;
  for (const Effect& effect : robot_.effects) {
    for (std::size_t k = 0; k < effect.values.size(); ++k, ++next) {
      if (effect.type == "joint_map" && reasons[next].empty()) reasons[next] = "joint maps stay as they are";
    }
  }
  Eigen::MatrixXd jacobian = position_jacobian(robot_, basis);
  Robot rigid = robot_;
  rigid.effects.clear();
  jacobian.leftCols(geometric) = position_jacobian(rigid, basis);
  fix_dependent(all, jacobian, geometric, options.dependence_tolerance, reasons);
  set_priors(all, geometric, options);
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (reasons[k].empty()) {
      columns_.push_back(static_cast<Eigen::Index>(k));
      parameters_.push_back(all[k]);
    } else {
      fixed_.push_back({all[k].name, reasons[k]});
    }
  }
}

Eigen::MatrixXd PoseModel::derivatives(const Poses& poses) const {
  Eigen::MatrixXd result(3 * poses.count(), std::ssize(columns_));
  // Block by block: all parameters of all poses at once would fill the memory.
  constexpr Eigen::Index block = 1000;
  for (Eigen::Index first = 0; first < poses.count(); first += block) {
    std::vector<Eigen::Index> rows(std::min(block, poses.count() - first));
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = first + static_cast<Eigen::Index>(i);
    result.middleRows(3 * first, 3 * std::ssize(rows)) = position_jacobian(robot_, select(poses, rows), columns_);
  }
  for (std::size_t k = 0; k < parameters_.size(); ++k) result.col(k) *= parameters_[k].scale;
  return result;
}

Eigen::VectorXd PoseModel::priors() const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(std::ssize(parameters_));
  for (std::size_t k = 0; k < parameters_.size(); ++k) {
    const discovery::Parameter& parameter = parameters_[k];
    if (parameter.prior_sigma) result(k) = std::pow(parameter.scale / *parameter.prior_sigma, 2);
  }
  return result;
}

}  // namespace llmt::robotics
