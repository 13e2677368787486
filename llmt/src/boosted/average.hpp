/// \file
/// Weighted means of variants of a sum and of one tree, whose shares held-out rows decide.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "boosted/boosting.hpp"
#include "boosted/boosting_data.hpp"
#include "llmt/boosted.hpp"
#include "llmt/options.hpp"

namespace llmt {

/// The shares a >= 0, with the sum 1, that make a' (Q + p I) a smallest. Q = E'W E / sum(w) are the mean products of
/// `residuals`, rows x variants, and p = min_k Q_kk / sqrt(rows), which draws the shares together as the rows are few.
/// `rows`: those that count.
Eigen::VectorXd shares_of(const Eigen::MatrixXd& residuals, const Eigen::VectorXd& weights,
                          const std::vector<int>& rows);

/// A sum whose parts are its variants, for a standardised output.
struct Average {
  std::vector<SumPart> parts = {};
  std::vector<BoostVariant> variants = {};  ///< all that were compared, with their errors on held-out rows
  Eigen::VectorXd residuals = {};           ///< of the held-out rows, of trees fitted without them
  double rmse = 0.0;                        ///< of these
  double train_rmse = 0.0;
  std::optional<FitOptions> tree = {};  ///< of the one tree that with_one_tree() took, with nothing left to choose
};

/// Few rows: the mean of symmetric trees, soft ones and one tree, fitted to all rows. Where there is no tree, soft ones
/// that start from a linear model take its place. `output`: standardised. `usual`: symmetric trees, the first variant.
/// `data.hold_outs` are folds of all rows, so every row is held out.
Average average(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, bool is_rate_given,
                Random& random, Work& work);

/// More rows: the mean of `sum`, its only part, and one tree of all rows, if one tree of fewer rows is better than the
/// sum of these on the held-out rows. Else the sum as it is. Its variants come behind those that are there.
Average with_one_tree(const BoostingData& data, const Eigen::VectorXd& output, Average sum, int max_threads,
                      Work& work);

}  // namespace llmt
