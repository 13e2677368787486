/// \file
/// New values of inputs beside those of training.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/check.hpp"

namespace llmt {

/// The inputs that a model uses; probabilities before Holm's correction. `at`: the new rows, categories as positions,
/// those of empty cells that are a level too, unknown ones as others. `record`: may be empty.
std::vector<CheckedInput> check_inputs(const std::vector<InputColumn>& columns, const std::vector<bool>& used,
                                       const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::MatrixXd& at,
                                       const TrainingRecord& record);

}  // namespace llmt
