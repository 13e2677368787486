/// \file
/// How many leaves: held-out error of the nested prefixes of a growth.
#pragma once

#include <Eigen/Core>

#include "llmt/model.hpp"

namespace llmt {

/// Sum of squared errors of the prefixes of `partition` with 1, 2, ..., num_leaves leaves over some rows.
///
/// split_values: rows x model inputs; deviations: rows x regression inputs, from the partition's centre; outputs: rows
/// x outputs of the partition; weights: of the outputs' squared errors.
Eigen::VectorXd prefix_squared_errors(const Partition& partition, const Eigen::MatrixXd& inputs,
                                      const Eigen::MatrixXd& deviations, const Eigen::MatrixXd& outputs,
                                      const Eigen::VectorXd& weights);

}  // namespace llmt
