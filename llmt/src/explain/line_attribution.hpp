/// \file
/// Shares of the inputs in the change of one partition's prediction along a straight line
/// (docs/algorithms/explanation.md, X.1).
#pragma once

#include <Eigen/Core>

#include "llmt/explain.hpp"
#include "model/evaluator.hpp"

namespace llmt {

/// How well a line is integrated.
struct Precision {
  double tolerance;  ///< of the sum over a piece, as a fraction of the output's range
  bool exact;        ///< cut at all kinks and choose orders by degree; else take equal pieces and one order
};
inline constexpr Precision fine = {1e-10, true};
inline constexpr Precision coarse = {1e-4, false};

/// Sets the rows of the partition's outputs in `result`, whose matrices have their sizes. See attribute().
void attribute_along_line(const Model& model, const Partition& partition, const Evaluator& evaluator,
                          const Eigen::Ref<const Eigen::VectorXd>& point,
                          const Eigen::Ref<const Eigen::VectorXd>& reference, const Precision& precision,
                          Attribution& result);

}  // namespace llmt
