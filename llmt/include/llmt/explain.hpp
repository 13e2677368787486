/// \file
/// What a prediction is made of: exact shares of the inputs at one point, and their weight over a table.
///
///     const llmt::Attribution why = llmt::attribute(model, inputs.row(0).transpose());
///     const double by_first_input = why.contributions(0, 0);  // rows sum to prediction - reference
#pragma once

#include <Eigen/Core>

#include "llmt/abi.hpp"
#include "llmt/model.hpp"
#include "llmt/progress.hpp"

namespace llmt {

/// A prediction, and how far each input moved it away from the prediction at a reference point.
struct Attribution {
  Eigen::VectorXd prediction;     ///< at the point, one per output, in the output's unit
  Eigen::VectorXd reference;      ///< at the reference point
  Eigen::MatrixXd contributions;  ///< outputs x inputs, in the output's unit; rows sum to prediction - reference
};

/// Where explanations start from unless told otherwise: numbers at their training mean (InputColumn::centre),
/// categorical inputs missing (NaN), that is at the mean of the local models and the shares learned at the splits.
Eigen::VectorXd reference_point(const Model& model);

/// The Aumann-Shapley shares of the inputs in F(point) - F(reference), F the prediction: along the straight line
/// x(t) = reference + t (point - reference), t from 0 to 1,
///   contribution_j = (point_j - reference_j) * integral_0^1 dF/dx_j(x(t)) dt + the jumps of F that belong to j
/// (Aumann & Shapley 1974; "integrated gradients" of Sundararajan, Taly & Yan 2017). The shares add up (completeness),
/// an input that the model does not use gets nothing, inputs that the model treats alike get alike from alike values,
/// and neither the units of the inputs nor splitting the model into a sum of models changes anything. An affine model
/// gives slope_j (point_j - reference_j).
///
/// The theory asks for a differentiable F; what jumps is shared out by rules of ours: where the line crosses the
/// threshold of a split without transition, the jump belongs to the split input, and at an oblique split to the inputs
/// as they move what it compares, which is the limit of ever steeper gates. An input that cannot move along a line
/// - categorical, or missing (NaN) at one end - keeps the value of the reference up to t = 1/2 and has that of the
/// point from there on; the jump belongs to it. Jumps at the same t are taken one after the other in the order of the
/// columns, at t = 1/2 those of thresholds before switched inputs.
///
/// Computed to about 1e-10 of the output's range in training: the line is cut where it leaves a transition or the range
/// of a node, in between the integrands of crisp models and blends are polynomials, which Gauss-Legendre integrates
/// exactly; pieces whose shares do not add up (held outputs, Gaussians, logistic gates) are halved. What is left of the
/// sum is divided over the piece's inputs in proportion, so that contributions add up to rounding.
///
/// Throws std::invalid_argument if a vector does not have the model's number of inputs or holds an infinite value.
Attribution attribute(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& point,
                      const Eigen::Ref<const Eigen::VectorXd>& reference);

/// As above, from reference_point().
Attribution attribute(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& point);

/// importance() looks at no more than this many rows, evenly spaced over the table.
inline constexpr Eigen::Index importance_rows = 500;

/// How much each input moves the predictions over a table, outputs x inputs: the mean of |contribution| of attribute()
/// from reference_point() over at most `importance_rows` rows, divided by its sum over the inputs. Rows sum to 1, or
/// are 0 where the prediction does not change. Integrals are taken to 1e-4 of the output's range.
///
/// It says what the model uses, not what causes the output; inputs that move together share as the model happens to
/// weigh them. Same bytes at any number of threads (0: all). Reports to `progress` after each row.
///
/// Throws std::invalid_argument if the number of columns differs, a value is infinite or there is no row.
Eigen::MatrixXd importance(const Model& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads = 0,
                           const Progress& progress = {});

}  // namespace llmt
