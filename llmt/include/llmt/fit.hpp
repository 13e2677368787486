/// \file
/// Growing local linear model trees from data.
#pragma once

#include <Eigen/Core>

#include "llmt/abi.hpp"
#include "llmt/intervals.hpp"
#include "llmt/model.hpp"
#include "llmt/options.hpp"
#include "llmt/summary.hpp"

namespace llmt {

struct FitResult {
  Model model;
  FitSummary summary;
  Intervals intervals;  ///< from the folds; empty without folds or FitOptions::intervals
};

/// Grows a local linear model tree for every output, or one for all.
///
/// inputs: rows x inputs; outputs: rows x outputs. Columns are named x1, x2, ... and y1, y2, ... (a single output: y);
/// see Model::named().
///
/// A leaf fits its rows by least squares, as a correction of its parent's local model of minimum norm (inputs scaled to
/// unit variance in the leaf). Where the rows do not determine a direction - fewer rows than coefficients, constant or
/// collinear columns - the parent's slope in that direction stays; at the root it is zero. Nothing in the result
/// depends on the order of rows or on the number of threads, nor on scale and offset of inputs and outputs, beyond
/// rounding; but for many rows the samples that candidates are compared on, and bins, depend on the values.
/// Equally good splits: the first input, then the smallest threshold.
///
/// Inputs may be missing (NaN), see Model; outputs may not.
///
/// Throws std::invalid_argument naming argument, value and bound: no rows or columns, row counts that differ, an
/// infinite input or an output that is not finite, an option out of range, a column index out of range or repeated, a
/// category that is not a whole number from 0 on, more than 13 numeric regression inputs for quadratic local models,
/// sparse ones with Estimation::as_grown where leaves overlap, a sign other than -1, 0, 1 or of a categorical input,
/// signs with sparse local models.
FitResult fit(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
              const FitOptions& options = {});

/// Root mean square error of each column, in its unit. Throws std::invalid_argument if the shapes differ or there is no
/// row.
Eigen::VectorXd rmse(const Eigen::Ref<const Eigen::MatrixXd>& predicted,
                     const Eigen::Ref<const Eigen::MatrixXd>& measured);

}  // namespace llmt
