/// \file
/// At which splits of a grown tree the outputs really jump.
#pragma once

#include <Eigen/Core>

#include "data/dataset.hpp"

namespace llmt {

/// For every node of a grown tree: how far the outputs jump at its threshold, as a multiple of the scatter of the rows
/// there; 0 in leaves, at splits on categories, at oblique ones and where rows do not tell.
///
/// Two linear models are fitted to a narrow band of the node's rows on either side of the threshold, and the root mean
/// square of the gap between them on the plane x_j = threshold, its sampling variance taken off, is divided by the
/// standard deviation of their residuals. Bands are equally wide: so curvature, which bends both models alike, does not
/// look like a jump, nor does a kink. Where rows are few, the gap is a constant.
Eigen::VectorXd jump_sizes(const TrainingRows& training, const Partition& grown, int max_threads);

}  // namespace llmt
