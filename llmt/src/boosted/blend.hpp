/// \file
/// The sum of few rows: a weighted mean of several variants, whose shares folds decide.
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
  std::vector<BoostVariant> variants;  ///< all, with their errors in folds
  Eigen::VectorXd residuals;           ///< of every row, when it was held out: of the whole procedure
  double train_rmse = 0.0;
};

/// `output`: standardised. `usual`: symmetric trees, the first variant. `data.hold_outs` are folds of all rows.
Blend blend(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, bool is_rate_given,
            Random& random, Work& work);

}  // namespace llmt
