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

/// A signal as the samples beside each sample show it: the mean of those `ceil(1 / independent_share)` places before
/// and after, of the same stretch; of one where there is one, and the sample's own value where there is none.
///
/// An error of an input moves the simulation at its sample, and so the deviation there. Samples that the error makes
/// alike in this input, seen beside the others, then have like deviations though nothing is missing. Samples beside it
/// have other errors (a lagged value as an instrument: Fuller 1987, section 1.4).
Eigen::VectorXd between_neighbours(const Eigen::VectorXd& signal, const std::vector<Eigen::Index>& stretches,
                                   double independent_share);

}  // namespace llmt::discovery
