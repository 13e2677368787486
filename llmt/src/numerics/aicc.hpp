/// \file
/// The corrected Akaike criterion of models whose local models are estimated locally.
#pragma once

#include <Eigen/Core>

namespace llmt {

/// tr[(A' Q W A)^-1 A' Q W Q A] with a row [1, deviations] of A for each row, Q the validities and W the weights: how
/// many parameters a locally estimated model really has.
double effective_parameters(const Eigen::MatrixXd& deviations, const Eigen::VectorXd& weights,
                            const Eigen::VectorXd& validity);

/// rows ln(loss / rows) + 2 k + 2 k (k + 1) / (rows - k - 1); infinity where that has no meaning.
double aicc(double rows, double loss, double effective);

}  // namespace llmt
