/// \file
/// What the studies are made on: functions whose truth is known, the two tasks of Benes et al. (2022), and data sets
/// with given splits.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "data_sets.hpp"

namespace bench {

struct Task {
  std::string name;
  std::vector<std::string> inputs;  ///< names of the input columns
  int trials = 1;                   ///< random seeds, or given splits
  std::function<Trial(int trial)> trial;
};

/// Which tasks a study runs on.
struct TaskChoice {
  std::string folder;              ///< of data sets with given splits; empty: the functions whose truth is known
  std::vector<std::string> names;  ///< empty: all
  int trials = 5;                  ///< upper limit of the trials of each task
};

/// - cross: Schaal & Atkeson (1998), max(exp(-10 x1^2), exp(-50 x2^2), 1.25 exp(-5 (x1^2 + x2^2))) + N(0, 0.1^2) on
///   [-1, 1]^2, 500 rows, test 41 x 41 grid.
/// - friedman1: Friedman (1991), 10 sin(pi x1 x2) + 20 (x3 - 0.5)^2 + 10 x4 + 5 x5 + N(0, 1) on [0, 1]^10, 2000 rows.
/// - ridge: tanh(4 w.x) + 0.5 exp(-(v.x)^2) of two oblique directions + N(0, 0.05^2) on [-1, 1]^5, 2000 rows.
/// - jumps: the function of synthetic.hpp in 10 inputs, 10000 rows.
/// - arm residual, arm x: x of the flexible planar arm minus that of its calibrated rigid model, and x itself, mm;
///   1536 poses, test 5985, no noise.
std::vector<Task> known_truths();

/// The chosen tasks, in the order of the names. Throws std::invalid_argument for the name of no known truth.
std::vector<Task> chosen_tasks(const TaskChoice& choice);

}  // namespace bench
