// Prediction as docs/algorithms.md writes it down, equation by equation and without a thought of speed.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "llmt/model.hpp"

namespace oracle {

/// Deviations of the regressors from their centres at a row of inputs; NaN where the input is missing.
Eigen::VectorXd deviations(const llmt::Model& model, const Eigen::VectorXd& row);

/// Validity of every node's box at a row of inputs, zero for inner nodes: equations 6 and 8.
std::vector<double> validities(const llmt::Model& model, const llmt::Partition& partition, const Eigen::VectorXd& row);

/// All outputs at a row of inputs: equations 5, 13 and 14.
Eigen::VectorXd predict(const llmt::Model& model, const Eigen::VectorXd& row);

/// predict() of every row.
Eigen::MatrixXd predict_rows(const llmt::Model& model, const Eigen::MatrixXd& rows);

}  // namespace oracle
