/// \file
/// How good intervals are as a whole: the continuous ranked probability score.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// The probabilities (k - 1/2) / count, k = 1 ... count, of the quantiles that crps() takes.
std::vector<double> crps_probabilities(int count);

/// The continuous ranked probability score of each row, in the unit of the output: of a distribution F and an observed
/// y
///   CRPS = integral of (F(z) - [z >= y])^2 dz = 2 integral of ([y < q_p] - p) (q_p - y) dp
/// (Matheson & Winkler 1976; Laio & Tamea 2007, eq. 8, for quantiles q_p), here the mean over p = (k - 1/2) / K. Of a
/// certain forecast it is the absolute error. `quantiles`: rows x K. Throws std::invalid_argument if there are none, or
/// the numbers of rows differ.
Eigen::VectorXd crps(const Eigen::Ref<const Eigen::MatrixXd>& quantiles,
                     const Eigen::Ref<const Eigen::VectorXd>& observed);

}  // namespace llmt
