// Rows in folds, a tree that was grown without each of them, and every candidate made and asked by itself.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "data/dataset.hpp"
#include "data/fold_rows.hpp"
#include "estimation/estimate.hpp"
#include "estimation/jumps.hpp"
#include "llmt/model.hpp"
#include "oracles/random_trees.hpp"
#include "selection/selection.hpp"

namespace folded_problem {

inline constexpr int fold_count = 3;
inline const Eigen::VectorXd one_output = Eigen::VectorXd::Ones(1);  ///< weights

/// Row i is held out in fold i modulo the number of folds.
struct Problem {
  Problem(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& output, Eigen::Index most_leaves,
          int number_of_folds = fold_count, const std::vector<int>& monotone = {})
      : x(inputs), y(output), table{x, y, Eigen::VectorXd::Ones(x.rows()), {}, {}, {}}, held(number_of_folds) {
    for (int j = 0; j < x.cols(); ++j) {
      table.num_levels.push_back(0);
      table.regression_inputs.push_back(j);
      table.split_inputs.push_back(j);
    }
    table.slope_signs = monotone;
    table.monotone = monotone;
    for (int fold = 0; fold < number_of_folds; ++fold) {
      std::vector<int> learned;
      for (int i = 0; i < x.rows(); ++i) (i % number_of_folds == fold ? held[fold] : learned).push_back(i);
      const llmt::TrainingRows training = llmt::training_rows(table, learned);
      folds.push_back({training, llmt::query_rows(table, held[fold], training)});
      const llmt::FitOptions options =
          random_trees::only(random_trees::kinds[0], llmt::Estimation::as_grown, most_leaves);
      const llmt::Model grown = llmt::fit(x(learned, Eigen::all), y(learned, Eigen::all), options).model;
      const llmt::Partition& partition = grown.partitions()[0];
      trees.push_back({partition, llmt::jump_sizes(training, partition, 1)});
    }
  }
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;

  llmt::Selection select(const llmt::Candidates& candidates) const {
    llmt::Work uncounted;
    return llmt::select(folds, trees, candidates, one_output, 1, uncounted);
  }

  /// Squared errors of the held-out rows of a fold, of a model that is made by itself and predicts row by row.
  Eigen::VectorXd squared_errors(const llmt::Candidate& candidate, int fold) const {
    llmt::Work uncounted;
    llmt::Candidate here = candidate;
    here.leaves = std::min(candidate.leaves, trees[fold].partition.num_leaves());
    const llmt::TrainingRows& training = folds[fold].training;
    const llmt::Partition made = llmt::estimate(training, trees[fold], here, 1, uncounted);
    const llmt::Model model{training.columns, training.output_columns, training.regressors, {made}};
    return (model.predict(x(held[fold], Eigen::all)) - y(held[fold], Eigen::all)).col(0).cwiseAbs2();
  }

  /// Their sum in each fold.
  std::vector<double> errors_of(const llmt::Candidate& candidate) const {
    std::vector<double> errors;
    for (int fold = 0; fold < std::ssize(folds); ++fold) errors.push_back(squared_errors(candidate, fold).sum());
    return errors;
  }

  double rmse_of(const llmt::Candidate& candidate) const {
    double sum = 0.0;
    for (const double error : errors_of(candidate)) sum += error;
    return std::sqrt(sum / static_cast<double>(x.rows()));
  }

  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
  llmt::Table table;
  std::vector<std::vector<int>> held;
  std::vector<llmt::FoldRows> folds;
  std::vector<llmt::GrownTree> trees;
};

}  // namespace folded_problem
