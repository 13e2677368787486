/// \file
/// Checks of the data, and the table of their columns.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/table.hpp"
#include "llmt/options.hpp"

namespace llmt {

/// Throws std::invalid_argument as fit() for inputs, outputs or weights (one a row, or none) that no model can be
/// learned from, and for trends and terms that do not go with them. `categorical`: columns of the inputs.
void check_data(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                const Eigen::VectorXd& weights, const std::vector<int>& categorical, const FitOptions& options);

/// Throws std::invalid_argument for numbers whose squares would overflow or vanish. `name`: of the matrix.
void check_magnitudes(const char* name, const Eigen::Ref<const Eigen::MatrixXd>& values);

/// The table of some rows, by the columns that the options name; none named means all. The table views the matrices.
/// `orders_splits`: the growth rule can split on inputs in which the prediction is to be monotone; else these are not
/// split.
Table make_table(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                 Eigen::VectorXd weights, const std::vector<int>& categorical, const FitOptions& options,
                 bool orders_splits);

}  // namespace llmt
