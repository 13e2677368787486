/// \file
/// Growing local linear model trees from data.
///
///     llmt::FitOptions options;
///     options.trends = {llmt::Trend::rising, llmt::Trend::any};         // y never falls when x1 rises
///     const llmt::FitResult result = llmt::fit(inputs, output, options);
///     const double error = result.summary.partitions[0].chosen.rmse;    // on held-out rows
///     const Eigen::MatrixXd y = result.model.predict(queries);
///     llmt::save(result.model, result.intervals, "model.json");
#pragma once

#include <Eigen/Core>

#include <memory>

#include "llmt/abi.hpp"
#include "llmt/fit_result.hpp"
#include "llmt/intervals.hpp"
#include "llmt/model.hpp"
#include "llmt/options.hpp"
#include "llmt/progress.hpp"
#include "llmt/summary.hpp"
#include "llmt/training_data.hpp"

namespace llmt {

/// Grows a local linear model tree for every output, or one for all.
///
/// Inputs may be missing (NaN), see Model; outputs may not. Columns without names are x1, x2, ... and y1, y2, ... (a
/// single output: y).
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
/// range or repeated, a category that is not a whole number from 0 on or has no name among its levels, weights or
/// groups that are not finite or not one a row, names that are too few, too many or repeated.
///
/// `progress` is called as the work goes on, and may cancel it.
FitResult fit(const TrainingData& data, const FitOptions& options = {}, const Progress& progress = {});

/// The fit of matrices about whose rows and columns nothing else is known.
FitResult fit(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
              const FitOptions& options = {}, const Progress& progress = {});

struct PreparedRows;

/// Data and options of a fit with the rows made ready: checked, weighted by the loss, dealt to folds, codes chosen.
/// Make one where several results come from the same rows, such as a model and a readable tree beside it:
///
///     const llmt::PreparedFit prepared({inputs, outputs}, options);
///     const llmt::FitResult result = llmt::fit(prepared);
///     const llmt::ReadableResult readable = llmt::fit_readable(prepared, result.summary);
///
/// Copies share everything. It may be used by several threads at a time.
class PreparedFit {
 public:
  /// Throws std::invalid_argument as fit(). `progress`: of the preparation.
  explicit PreparedFit(TrainingData data, const FitOptions& options = {}, const Progress& progress = {});
  /// Shares the data with the caller.
  explicit PreparedFit(std::shared_ptr<const TrainingData> data, const FitOptions& options = {},
                       const Progress& progress = {});

  const TrainingData& data() const;

  /// For the library.
  const PreparedRows& rows() const;
  PreparedFit with_rows(PreparedRows rows) const;

 private:
  struct Parts;
  std::shared_ptr<const Parts> parts_;
};

/// The fit of prepared data: as fit() of the same data and options.
FitResult fit(const PreparedFit& prepared, const Progress& progress = {});

/// Root mean square error of each column, in its unit. Throws std::invalid_argument if the shapes differ or there is no
/// row.
Eigen::VectorXd rmse(const Eigen::Ref<const Eigen::MatrixXd>& predicted,
                     const Eigen::Ref<const Eigen::MatrixXd>& measured);

}  // namespace llmt
