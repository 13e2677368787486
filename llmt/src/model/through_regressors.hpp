/// \file
/// Derivatives with respect to inputs from derivatives with respect to regressors (chain rule).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

inline bool is_product(const Regressor& regressor) { return regressor.second_input >= 0; }

/// Adds to `by_input` (outputs x inputs) what `by_regressor` (outputs x regressors), the derivatives at the inputs
/// `row`, contribute through the regressors. Levels contribute nothing, nor do products with a missing factor.
void add_through_regressors(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors,
                            const double* row, const Eigen::MatrixXd& by_regressor, Eigen::MatrixXd& by_input);

}  // namespace llmt
