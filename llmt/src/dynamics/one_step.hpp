/// \file
/// The map of a dynamic model laid out for evaluation, with its derivatives by regressors and by parameters.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/dynamic_model.hpp"
#include "partition/evaluator.hpp"

namespace llmt {

/// y = p(x) + r(x), see DynamicModel. It has room for what it computes: not for several threads at a time.
///
/// The parameters are, output by output, the coefficients of the polynomial and then, of a tree, value and slopes of
/// each leaf (in the order of the nodes) that serves the output. Validities and guards are fixed.
class OneStep {
 public:
  /// `parts` must live as long as this.
  explicit OneStep(const DynamicParts& parts);

  Eigen::Index parameters() const { return parameters_; }
  Eigen::Index outputs() const { return outputs_; }

  /// The outputs at regressors `x`.
  void values(const double* x, double* y);

  /// The same with derivatives: by_regressor outputs x regressors, by_parameter parameters x outputs.
  void derivatives(const double* x, double* y, Eigen::MatrixXd& by_regressor, Eigen::MatrixXd& by_parameter);

 private:
  void add_rest(const double* x, double* y);
  void add_tree_derivatives(const double* x, double* y, Eigen::MatrixXd& by_regressor, Eigen::MatrixXd& by_parameter);
  void add_sum_slopes(const double* x, Eigen::MatrixXd& by_regressor);

  const DynamicParts& parts_;
  Eigen::Index outputs_;
  Eigen::Index parameters_ = 0;
  std::vector<Evaluator> evaluators_;  // of a tree's partitions
  std::vector<std::vector<Eigen::Index>>
      places_;                                 // [partition][node]: first parameter of its first output; -1: no leaf
  std::vector<Eigen::Index> place_of_output_;  // of the polynomial's coefficients
  Eigen::VectorXd z_;
  Eigen::VectorXd products_;
  Eigen::VectorXd deviations_;
  Eigen::VectorXd values_;
  Eigen::VectorXd local_;
  std::vector<Activation> active_;
};

/// The parameters of the map in the order of OneStep.
Eigen::VectorXd parameters_of(const DynamicParts& parts);

/// The map with other parameters.
DynamicParts with_parameters(const DynamicParts& parts, const Eigen::VectorXd& parameters);

/// Whether a parameter belongs to a product of two or more regressors, or to the rest: what a linear model lacks.
std::vector<bool> are_beyond_linear(const DynamicParts& parts);

}  // namespace llmt
