/// \file
/// Rounds of boosting on the rows of a fit.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "boosted/growing_tree.hpp"
#include "llmt/progress.hpp"

namespace llmt {

inline constexpr double usual_softness = 0.6;  ///< TreeOptions::softness of soft trees
inline constexpr double soft_rate = 0.1;       ///< of soft trees
inline constexpr double more_trees = 1.25;     ///< on all rows, by those that held-out rows asked for

struct RoundOptions {
  TreeOptions tree = {};
  double rate = 0.1;
  int most_rounds = 2000;
  int patience = 50;       ///< rounds without a smaller error on held-out rows after which boosting stops
  bool keep_path = false;  ///< Rounds::path is wanted
  int max_threads = 0;
};

/// Trees on residuals: F = mean; in every round F += rate . tree(y - F).
struct Rounds {
  double base = 0.0;
  std::vector<GrowingTree> trees;
  double rmse = 0.0;                       ///< on the held-out rows, of these trees; NaN without such rows
  Eigen::VectorXd residuals = {};          ///< of the held-out rows, of these trees; without such rows, of the others
  std::vector<Eigen::VectorXd> path = {};  ///< of the held-out rows, before the first round and after each one tried
  double train_rmse = 0.0;                 ///< on the others; with held-out rows, after the last round that was tried
};

/// The square root of the weighted mean of squares.
double rmse_of(const Eigen::Ref<const Eigen::VectorXd>& residuals, const Eigen::Ref<const Eigen::VectorXd>& weights);

/// Boosts on the rows `train` until the error on `held_out` has not become smaller for `patience` rounds, and keeps the
/// trees up to the smallest. Without held-out rows it makes most_rounds trees. `structures`: trees whose splits the
/// first rounds take.
Rounds boost(const BinnedRows& rows, const Eigen::VectorXd& output, const std::vector<int>& train,
             const std::vector<int>& held_out, const std::vector<GrowingTree>& structures, const RoundOptions& options,
             Random& random, Work& work);

/// Rounds that are a part of a sum, with the trees whose residuals they started from.
struct SumPart {
  double share = 1.0;
  double rate = 1.0;
  Rounds rounds = {};
  std::vector<BoostedTree> start = {};
};

/// mean + scale . sum of share . (base + start + rate . trees), the shares adding up to 1. Its rate is the first
/// part's; the leaves of the other trees are multiplied by what theirs differs.
BoostedSum sum_of(const std::vector<SumPart>& members, const BinnedRows& rows, double mean, double scale);

}  // namespace llmt
