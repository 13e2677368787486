/// \file
/// Weighted means of variants of a sum and of one tree, whose shares held-out rows decide.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "boosted/boosting_data.hpp"
#include "boosted/sum_parts.hpp"
#include "llmt/boosted.hpp"

namespace llmt {

/// The shares a >= 0, with the sum 1, that make a' (Q + p I) a smallest. Q = E'W E / sum(w) are the mean products of
/// `residuals`, rows x variants, and p = min_k Q_kk / sqrt(rows), which draws the shares together as the rows are few.
/// `rows`: those that count.
Eigen::VectorXd shares_of(const Eigen::MatrixXd& residuals, const Eigen::VectorXd& weights,
                          const std::vector<int>& rows);

struct Blend {
  std::vector<SumPart> parts;          ///< fitted to all rows
  std::vector<BoostVariant> variants;  ///< all, with their errors on held-out rows
  Eigen::VectorXd residuals;           ///< of the held-out rows, of trees fitted without them
  double rmse = 0.0;                   ///< of these
  double train_rmse = 0.0;
};

/// Few rows: the mean of four variants of a sum and one tree. `output`: standardised. `usual`: symmetric trees, the
/// first variant. `data.hold_outs` are folds of all rows, so every row is held out.
Blend blend(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, bool is_rate_given,
            Random& random, Work& work);

/// More rows: the mean of the `sum` of all rows and one tree, if one tree of fewer rows is better than the sum of these
/// by more than 1 / sqrt(m) of the error on the m held-out rows. There the sum leaves `residuals`. Else the sum alone.
Blend with_one_tree(const BoostingData& data, const Eigen::VectorXd& output, SumPart sum,
                    const Eigen::VectorXd& residuals, int max_threads, Work& work);

}  // namespace llmt
