/// \file
/// The normal equations of a partition from the rows.
#pragma once

#include <Eigen/Core>

#include "data/dataset.hpp"
#include "estimation/sums/normal_equations.hpp"
#include "partition/evaluator.hpp"

namespace llmt {

/// True if rows that a missing value sends to several leaves are left out of the sums, because they would distort the
/// models of all these leaves. They are not left out if they are more than half of the weight.
bool leaves_out_ambiguous(const TrainingRows& training, const Evaluator& evaluator, int max_threads);

/// Forms the sums over all rows, and sets the ranges of the nodes to those of the rows that their validities reach.
/// `root`: coefficients of the root's model in scaled columns, size x outputs.
NormalEquations assemble(const TrainingRows& training, Partition& partition, const Eigen::MatrixXd& root,
                         int max_threads);

}  // namespace llmt
