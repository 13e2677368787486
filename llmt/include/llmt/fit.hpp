/// \file
/// Growing local linear model trees from data.
///
///     llmt::FitOptions options;
///     options.monotone = {1, 0};                                        // y never falls when x1 rises
///     const llmt::FitResult result = llmt::fit(inputs, output, options);
///     const double error = result.summary.partitions[0].chosen.rmse;    // on held-out rows
///     const Eigen::MatrixXd y = result.model.predict(queries);
///     llmt::save(result.model, result.intervals, "model.json");
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
  Intervals intervals;  ///< from the folds; empty without folds or without FitOptions::intervals
};

/// Grows a local linear model tree for every output, or one for all.
///
/// inputs: rows x inputs; outputs: rows x outputs. Columns are named x1, x2, ... and y1, y2, ... (a single output: y);
/// Model::named() renames them. Inputs may be missing (NaN), see Model; outputs may not.
///
/// A leaf's local model corrects its parent's by least squares on the leaf's rows, with the smallest norm of the
/// correction (inputs scaled to unit variance in the leaf). Where the rows do not determine a direction (fewer rows
/// than coefficients, constant or collinear columns) the parent's slope in that direction stays; at the root it is 0.
///
/// Up to rounding, the result does not depend on the order of rows, on the scale and offset of inputs and outputs, nor
/// on the number of threads, for which it is the same to the byte. The samples and bins that serve many rows depend on
/// the values. Of equally good splits the first input is taken, then the smallest threshold.
///
/// Throws std::invalid_argument naming argument, value and bound: no rows or columns, row counts that differ, an
/// infinite input or an output that is not finite, an option out of range or against another one, a column index out of
/// range or repeated, a category that is not a whole number from 0 on.
FitResult fit(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
              const FitOptions& options = {});

/// Root mean square error of each column, in its unit. Throws std::invalid_argument if the shapes differ or there is no
/// row.
Eigen::VectorXd rmse(const Eigen::Ref<const Eigen::MatrixXd>& predicted,
                     const Eigen::Ref<const Eigen::MatrixXd>& measured);

}  // namespace llmt
