/// \file
/// What all nodes of a growing tree share.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "growth/problem.hpp"

namespace llmt {

/// Ranks of the two children of a split.
struct SplitRanks {
  int left;
  int right;
};

/// The outputs of a growth problem in the form that growth works with, and the weights.
struct GrowthData {
  explicit GrowthData(const GrowthProblem& problem);

  const GrowthProblem& problem;
  const TrainingRows& training;
  std::vector<int> num_levels;  ///< of each split input; 0: a number
  Eigen::VectorXd weights;      ///< of the rows, with mean 1
  double total_weight = 0.0;    ///< their sum
  /// Outputs about their mean, divided by a power of two near their largest deviation: a target of scale 1e-6 and one
  /// with offset 1e8 look alike from here on, and dividing by a power of two rounds nothing.
  Eigen::MatrixXd outputs;
  Eigen::VectorXd output_mean;
  Eigen::VectorXd output_scale;
  Eigen::VectorXd output_weights;  ///< of their sums of squares: 1 / their total
  Eigen::VectorXd
      rounding;  ///< root mean square residual, in scaled outputs, that is rounding of the outputs themselves

  Eigen::Index split_inputs() const { return std::ssize(problem.options.split_inputs); }

  /// Value of a split input in a training row.
  double split_value(int row, Eigen::Index split_input) const {
    return training.table->inputs(training.rows[row], problem.options.split_inputs[split_input]);
  }

  /// The value of the split input at which the two child models meet, on average over the node's rows, if it lies in
  /// the gap low ... high; else the middle of the gap. `apart` and `slope`: value at the input's mean `mean` and slope
  /// of the regression of their difference on the input, one per output. The result is at least low and below high.
  double place_threshold(double low, double high, double mean, const Eigen::VectorXd& apart,
                         const Eigen::VectorXd& slope) const;

  /// The largest residual sum of squares of two child models with which a split may pass the significance test,
  /// whatever the children's ranks; infinity without a test. `weight`, `rank`, `rss`: of the node; `tested`: candidate
  /// splits, or fewer.
  double significant_rss(double weight, int rank, double rss, Eigen::Index tested) const;

  /// Whether a split passes the F test (eq. 2) at a level; 1 and more: any does. `weight`, `rank`, `rss`: of the node;
  /// `tested`: candidate splits.
  bool is_significant(double level, double weight, int rank, double rss, const SplitRanks& split, double split_rss,
                      Eigen::Index tested) const;

  /// Threads for work on `work` numbers: one where starting another costs more than it saves.
  int threads_for(Eigen::Index work) const { return work < 30000 ? 1 : problem.max_threads; }
};

}  // namespace llmt
