/// \file
/// The corrected Akaike criterion of models whose local models are estimated locally.
#pragma once

#include <Eigen/Core>

namespace llmt {

/// The effective number of parameters of a locally estimated model, tr[(A' Q W A)^-1 A' Q W Q A]. A has a row
/// [1, deviations] for each row of the data; Q are the validities and W the weights.
double effective_parameters(const Eigen::MatrixXd& deviations, const Eigen::VectorXd& weights,
                            const Eigen::VectorXd& validity);

/// rows ln(loss / rows) + 2 k + 2 k (k + 1) / (rows - k - 1); infinity if there are too few rows for it.
double aicc(double rows, double loss, double effective);

}  // namespace llmt
