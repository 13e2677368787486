/// \file
/// Nodes of a growing tree whose models are made from Gram matrices, all in one basis.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "growth/growth_data.hpp"
#include "numerics/whitening.hpp"

namespace llmt {

/// Features of all training rows, whose regressors are whitened once for the tree.
class WhitenedRows {
 public:
  explicit WhitenedRows(const GrowthData& data);

  const Features& features() const { return features_; }

  /// Scaled regressors (TrainingRows::scale) = colouring * regressors of the features.
  const Eigen::MatrixXd& colouring() const { return colouring_; }

  /// Takes the linear function value + slope . (scaled regressors) off the residuals of some rows.
  void subtract(const std::vector<int>& rows, const Eigen::VectorXd& value, const Eigen::MatrixXd& slope);

 private:
  Features features_;
  Eigen::MatrixXd colouring_;
};

/// Some rows with the sums over them.
struct WhitenedLeaf {
  std::vector<int> rows;  ///< of the training rows, ascending
  double weight = 0.0;    ///< of the rows
  Eigen::VectorXd value;  ///< the local model whose residuals the features of these rows hold
  Eigen::MatrixXd slope;
  Eigen::VectorXd mean;        ///< of the scaled regressors over the rows
  Eigen::MatrixXd covariance;  ///< of the scaled regressors
};

/// Whether no split input and no regressor is missing in any row. Whitened leaves require that.
bool is_complete(const GrowthData& data);

/// The leaf of all rows, with features that hold the outputs themselves: residuals of a model that is zero.
WhitenedLeaf whitened_root(const GrowthData& data);

/// Fills in `node` from the Gram matrix of the leaf's rows: the local model as a correction of the parent's, of minimum
/// norm in regressors of unit variance in the node.
void fit_whitened(const GrowthData& data, const WhitenedRows& rows, const std::vector<double>& gram, const Node& parent,
                  WhitenedLeaf& leaf, Node& node);

/// If the node's RSS is small against the RSS of the model whose residuals the features hold, differences of sums lose
/// digits. Then the node's own residuals take the place of those residuals, and the result is true: sums over the
/// leaf's rows must be formed anew.
bool refreshed(const GrowthData& data, WhitenedRows& rows, const std::vector<double>& gram, const Node& node,
               WhitenedLeaf& leaf);

/// The threshold of a split in the gap low ... high of a split input.
double place_threshold(const GrowthData& data, const WhitenedLeaf& leaf, Eigen::Index split_input, double low,
                       double high, const Node& node, const Node& left, const Node& right);

}  // namespace llmt
