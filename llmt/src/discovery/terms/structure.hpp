// Tests of residuals that should be noise: do they still depend on inputs?
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt::discovery {

struct StructureLeft {
  std::vector<Eigen::Index> columns;  // of the inputs that neighbours were taken in; empty: no test possible
  double p_value = 1.0;               // corrected for the number of tests
  double share = 0.0;                 // of the sum of squares that neighbours have in common
};

/// Neighbours in one input, in two, and in all: T = sum over neighbours of e_i e_j, against random signs of e, under
/// which T has mean 0 and variance sum w_ij^2 e_i^2 e_j^2. The most significant of all tests.
///
/// In time (`stretches` not empty: labels, samples of one label follow each other) neighbours are samples of different
/// times, 2 / independent_share apart, because noise is alike in samples that follow each other; and the variance is
/// larger by 1 / independent_share, because so are the products of pairs.
StructureLeft structure_left(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& errors,
                             const std::vector<Eigen::Index>& stretches = {}, double independent_share = 1.0);

}  // namespace llmt::discovery
