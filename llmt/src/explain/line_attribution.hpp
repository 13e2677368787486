/// \file
/// Shares of the inputs in the change of one partition's prediction along a straight line
/// (docs/algorithms/explanation.md, X.1).
#pragma once

#include <Eigen/Core>

#include "llmt/model.hpp"
#include "partition/evaluator.hpp"

namespace llmt {

/// The precision with which a line is integrated.
struct Precision {
  double tolerance;  ///< of the sum over a piece, as a fraction of the output's range
  bool exact;        ///< cut at all kinks and choose orders by degree; else take equal pieces and one order
};
inline constexpr Precision fine = {1e-10, true};
inline constexpr Precision coarse = {1e-4, false};

/// An Attribution of the partition's outputs alone.
struct LineAttribution {
  Eigen::VectorXd prediction;
  Eigen::VectorXd reference;
  Eigen::MatrixXd contributions;
};

/// See attribute().
LineAttribution attribute_along_line(const Model& model, const Partition& partition, const Evaluator& evaluator,
                                     const Eigen::Ref<const Eigen::VectorXd>& point,
                                     const Eigen::Ref<const Eigen::VectorXd>& reference, const Precision& precision);

}  // namespace llmt
