/// \file
/// What the members of the family are compared on: functions whose truth is known, the two tasks of Benes et al.
/// (2022), and data sets with given splits.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace bench {

/// Rows to learn from and rows to judge by: without noise where the truth is known.
struct Trial {
  Eigen::MatrixXd train_inputs;
  Eigen::VectorXd train_output;
  Eigen::MatrixXd test_inputs;
  Eigen::VectorXd test_output;
};

struct Task {
  std::string name;
  int trials = 1;
  std::function<Trial(int trial)> trial;
};

/// - cross: Schaal & Atkeson (1998), max(exp(-10 x1^2), exp(-50 x2^2), 1.25 exp(-5 (x1^2 + x2^2))) + N(0, 0.1^2) on
///   [-1, 1]^2, 500 rows, test 41 x 41 grid.
/// - friedman1: Friedman (1991), 10 sin(pi x1 x2) + 20 (x3 - 0.5)^2 + 10 x4 + 5 x5 + N(0, 1) on [0, 1]^10, 2000 rows.
/// - ridge: tanh(4 w.x) + 0.5 exp(-(v.x)^2) of two oblique directions + N(0, 0.05^2) on [-1, 1]^5, 2000 rows.
/// - jumps: the function of synthetic.hpp in 10 inputs, 10000 rows.
/// - arm residual, arm x: x of the flexible planar arm without what its calibrated rigid model says, and x itself, mm;
///   1536 poses, test 5985, no noise.
std::vector<Task> known_truths();

/// Every NAME.csv in the folder that has a NAME.splits.csv, as regression_sets reads them.
std::vector<Task> given_sets(const std::string& folder);

}  // namespace bench
