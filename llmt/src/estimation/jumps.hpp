/// \file
/// How far the outputs jump at the splits of a grown tree.
#pragma once

#include <Eigen/Core>

#include "data/dataset.hpp"

namespace llmt {

/// For every node of a grown tree: how far the outputs jump at its threshold, in units of the scatter of the rows
/// there, eq. (V.4) of docs/algorithms/validities.md. 0 in leaves, at splits on categories, at oblique splits, and
/// where there are too few rows to measure a jump.
///
/// Two linear models are fitted to the node's rows in two narrow bands, one on either side of the threshold. The root
/// mean square of the gap between them on the plane x_j = threshold, less its sampling variance, is divided by the
/// standard deviation of their residuals. Both bands have the same width, so curvature, which bends both models alike,
/// does not look like a jump; nor does a kink. Where rows are few, the gap is a constant.
Eigen::VectorXd jump_sizes(const TrainingRows& training, const Partition& grown, int max_threads);

}  // namespace llmt
