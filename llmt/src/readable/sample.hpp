/// \file
/// The rows of a fold as a readable tree needs them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/matrix.hpp"
#include "base/sum_over.hpp"
#include "data/fold_rows.hpp"
#include "numerics/forward_selection.hpp"

namespace llmt {

/// Some rows, one after the other.
struct RowValues {
  RowMajor inputs;      ///< NaN: missing
  RowMajor deviations;  ///< of the regressors from their centres; 0 where a value is missing
  RowMajor outputs;
  Eigen::VectorXd weights;

  Eigen::Index count() const { return weights.size(); }
};

/// The rows that trees are grown from, and those that they are judged on.
struct Sample {
  /// Training rows. Centres of numbers are rounded means, so that products of deviations can be printed; regressors are
  /// numbers and levels.
  TrainingRows described;
  std::vector<int> outputs;        ///< that the tree serves, columns of the table
  Eigen::VectorXd output_weights;  ///< of squared errors
  Eigen::VectorXd input_scale;     ///< root mean square deviation of each input; 1 where it does not vary
  RowValues training;
  RowValues held_out;  ///< none for all rows

  /// Sum of the weights of the training rows.
  double total_weight() const {
    return sum_of_rows(training.count(), [&](Eigen::Index i) { return training.weights(i); });
  }
};

/// `held_out`: null for all rows.
Sample make_sample(const TrainingRows& training, const TrainingRows* held_out, const std::vector<int>& outputs,
                   const Eigen::VectorXd& output_weights);

/// A term of an equation: a regressor, or the product of two.
struct Term {
  int first = 0;    ///< column of RowValues::deviations
  int second = -1;  ///< -1: none
};

/// The terms of the given inputs: their regressors and, with `products`, products and squares of numbers.
std::vector<Term> terms_of(const Sample& sample, const std::vector<int>& inputs, bool products);

/// The positions of each product's main terms; all -1 of a regressor.
std::vector<Parents> parents_of(const std::vector<Term>& terms);

/// The size that a term adds to an expression, coefficient and operators included (expression_size()).
Eigen::Index size_of_term(const Sample& sample, const Term& term);

}  // namespace llmt
