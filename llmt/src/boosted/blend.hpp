/// \file
/// Weighted means of variants of a sum and of one tree, whose shares held-out rows decide.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "boosted/boosting_data.hpp"
#include "boosted/sum_parts.hpp"
#include "llmt/boosted.hpp"
#include "llmt/options.hpp"

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

/// Few rows: the mean of symmetric trees, soft ones and one tree; where there is no tree, soft ones that start from a
/// linear model take its place. `output`: standardised. `usual`: symmetric trees, the first variant. `data.hold_outs`
/// are folds of all rows, so every row is held out.
Blend blend(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, bool is_rate_given,
            Random& random, Work& work);

struct NamedSum {
  std::string name;
  SumPart sum;
};

/// More rows: the mean of the `sum` of all rows and one tree, if one tree of fewer rows is better than the sum of these
/// on the held-out rows. There the sum leaves `residuals`. Else the sum alone. `rules`: by which a tree is tried.
Blend with_one_tree(const BoostingData& data, const Eigen::VectorXd& output, NamedSum sum,
                    const Eigen::VectorXd& residuals, std::span<const GrowthRule> rules, int max_threads, Work& work);

}  // namespace llmt
