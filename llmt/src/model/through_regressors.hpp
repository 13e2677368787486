/// \file
/// Derivatives by regressors as derivatives by inputs.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

inline bool is_product(const Regressor& regressor) { return regressor.second_input >= 0; }

/// Derivatives with respect to regressors at a row of inputs turned into those with respect to inputs, and added.
/// `by_regressor` outputs x regressors, `by_input` outputs x inputs. Levels have none, nor products with a factor that
/// is missing.
void add_through_regressors(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors,
                            const double* row, const Eigen::MatrixXd& by_regressor, Eigen::MatrixXd& by_input);

}  // namespace llmt
