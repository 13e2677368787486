/// \file
/// RETIS pruning.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// Prunes from the leaves up by m-estimates of the mean squared error (Karalic 1992): with E(t) = rss(t) / n_t and the
/// root's error as prior,
///   E_m(t) = (n_t E(t) + m E(root)) / (n_t + m)
/// a split goes if E_m(t) <= p_left E'(left) + p_right E'(right), with p = (n_child + m / 2) / (n_t + m) and E' the
/// smaller of both sides of this comparison one level down. `weights` add up the outputs. Keeps the order of growth.
/// True if anything was pruned.
bool prune(std::vector<Node>& nodes, const Eigen::VectorXd& weights, double m);

}  // namespace llmt
