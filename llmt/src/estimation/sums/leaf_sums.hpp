/// \file
/// The sums from which the local models of a partition, and of all its prefixes, are estimated.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/dataset.hpp"
#include "estimation/sums/normal_equations.hpp"
#include "llmt/partition.hpp"

namespace llmt {

/// What the estimates of a partition's local models have in common: the partition, the normal equations (E.4) of
/// docs/algorithms/estimation.md, and what constrains the coefficients.
///
/// Coefficients are [value, slopes] in columns divided by TrainingRows::scale, and as a difference from the root's
/// model: size() x outputs. The validity of an inner node is the sum of the validities below it, so one pass over the
/// rows serves every prefix of the tree, except where validities are Gaussian.
struct LeafSums {
  const TrainingRows* training = nullptr;
  int max_threads = 1;
  Partition partition;   ///< half widths as given, local models as grown, ranges and residual range set
  Eigen::MatrixXd root;  ///< coefficients of the root's model, size() x outputs
  NormalEquations equations;
  std::vector<std::vector<Eigen::Index>> selected;  ///< of every node, the coefficients of its sparse model; or empty
  std::vector<int> signs;                           ///< of the coefficients, see coefficient_signs()

  Eigen::Index size() const { return equations.size; }  ///< coefficients of a local model
};

/// Sums over all rows. `partition`: half widths set, local models as grown. `training` must live as long as the result.
/// `sparse`: whether sparse estimates will be asked for; then the regressors of every node are selected by (E.5).
LeafSums sum_leaves(const TrainingRows& training, Partition partition, int max_threads, bool sparse = false);

/// Smallest and largest residual of the root's model over the rows, outputs x 2.
Eigen::MatrixXd residual_range(const TrainingRows& rows, const Node& root, const std::vector<int>& outputs,
                               int max_threads);

/// Whether leaves have to be in order across some split (docs/algorithms/constraints.md). Then the estimates of a
/// prefix keep the order only if they were made for this prefix.
bool has_ordered_leaves(const LeafSums& sums);

/// The diagonal of H_i, eq. (E.2), for a shrinkage in rows, plus what keeps G_i + H_i positive definite.
Eigen::VectorXd shrinkage_diagonal(const LeafSums& sums, std::size_t node, double shrinkage);

/// Gives a node the local model with these coefficients.
void set_model(const LeafSums& sums, const Eigen::MatrixXd& coefficients, Node& node);

/// The prefix with `leaves` leaves whose nodes have these coefficients. `sparse`: the models are sparse ones; so ranks
/// are set to the number of coefficients, except for a root above leaves, which keeps its full model.
Partition with_models(const LeafSums& sums, Eigen::Index leaves, const std::vector<Eigen::MatrixXd>& models,
                      bool sparse);

}  // namespace llmt
