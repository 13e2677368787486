// The information that the poses of an arm have about its parameters.
#pragma once

#include <vector>

#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {

/// The parameters that a calibration would identify, and their derivatives.
class PoseModel {
 public:
  /// Chooses the parameters as calibrate() does, over `basis`. Effects that need columns which `basis` or `also` do not
  /// have are taken as known.
  PoseModel(const Robot& robot, const Poses& basis, const std::vector<const Poses*>& also,
            const CalibrationOptions& options);

  /// 3n x L derivatives of the tool positions by the identified parameters times their scales, mm.
  Eigen::MatrixXd derivatives(const Poses& poses) const;

  /// L: information of the weak priors.
  Eigen::VectorXd priors() const;

  const std::vector<discovery::Parameter>& parameters() const { return parameters_; }
  const std::vector<FixedParameter>& fixed() const { return fixed_; }
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  Robot robot_;
  std::vector<Eigen::Index> columns_;
  std::vector<discovery::Parameter> parameters_;
  std::vector<FixedParameter> fixed_;
  std::vector<std::string> left_out_;
};

}  // namespace llmt::robotics
