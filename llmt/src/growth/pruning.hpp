/// \file
/// Pruning of grown trees: by RETIS' m-estimates, and the order in which the weakest links go.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// Prunes from the leaves up by m-estimates of the mean squared error (Karalic 1992): with E(t) = rss(t) / n_t and the
/// root's error as prior,
///   E_m(t) = (n_t E(t) + m E(root)) / (n_t + m)
/// a split goes if E_m(t) <= p_left E'(left) + p_right E'(right), with p = (n_child + m / 2) / (n_t + m) and E' the
/// smaller of both sides of this comparison one level down. `weights` add up the outputs. Keeps the order of growth.
/// Returns where the nodes that stay were before.
std::vector<std::size_t> prune(std::vector<Node>& nodes, const Eigen::VectorXd& weights, double m);

/// The tree with its nodes in another order, so that the first M - 1 splits are what weakest-link pruning leaves of it
/// with M leaves: see Pruning::weakest_link. `gains`: of every node's split, 0 for leaves; empty: the difference of the
/// residual sums of squares of node and children, each output's divided by the root's.
std::vector<Node> in_pruning_order(const std::vector<Node>& nodes, std::vector<double> gains);

}  // namespace llmt
