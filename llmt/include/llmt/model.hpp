/// \file
/// The fitted model: a partition of the input space into boxes, and an affine local model in every box.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// One node of a partition's tree, inner or leaf. Inner nodes keep the local model they had when they were leaves.
struct Node {
  int left = -1;           ///< child for x[split_input] <= threshold; -1 in a leaf
  int right = -1;          ///< child for x[split_input] > threshold; -1 in a leaf
  int split_input = -1;    ///< column of the input that is compared; -1 in a leaf
  double threshold = 0.0;  ///< in the unit of that input

  std::ptrdiff_t samples = 0;  ///< training rows in the node's box
  int rank = 0;         ///< of [1, regression inputs] over those rows: the coefficients that the rows could determine
  Eigen::VectorXd rss;  ///< residual sum of squares of the local model over those rows, one per output of the partition
  Eigen::VectorXd value;  ///< local model at the centre of the inputs, one per output of the partition
  Eigen::MatrixXd slope;  ///< d output / d regression input, outputs of the partition x regression inputs

  bool is_leaf() const { return left < 0; }
};

/// A tree of axis-orthogonal splits that serves one or several outputs.
///
/// Nodes stand in the order of growth: node 0 is the root and the k-th split (k = 1, 2, ...) made the nodes 2k-1 (left)
/// and 2k (right). The first 2M-1 nodes are therefore the tree as it was with M leaves.
struct Partition {
  std::vector<int> outputs;  ///< columns of the model's outputs that this partition predicts, ascending
  std::vector<Node> nodes;   ///< in order of growth

  std::ptrdiff_t num_leaves() const { return (std::ssize(nodes) + 1) / 2; }
};

/// What a model knows of its inputs.
struct InputColumn {
  std::string name;
  double low = 0.0;     ///< smallest training value
  double high = 0.0;    ///< largest training value
  double centre = 0.0;  ///< mean of the training values; local models are written about it
};

/// What a model knows of its outputs.
struct OutputColumn {
  std::string name;
  double low = 0.0;   ///< smallest training value
  double high = 0.0;  ///< largest training value
};

/// A leaf as a person reads it: where it holds and what it says there.
struct Leaf {
  int node = 0;                ///< index into Partition::nodes
  std::ptrdiff_t samples = 0;  ///< training rows
  int rank = 0;                ///< as Node::rank
  Eigen::VectorXd low;         ///< box, one per model input: low < x <= high; -infinity where open
  Eigen::VectorXd high;        ///< +infinity where open
  Eigen::VectorXd rmse;        ///< sqrt(rss / samples) over the training rows, one per output of the partition
  Eigen::VectorXd intercept;   ///< local model at x = 0, one per output of the partition
  Eigen::MatrixXd slope;       ///< outputs of the partition x regression inputs
};

/// A fitted local linear model tree: immutable, always complete, safe to use from many threads.
///
/// For output o, served by partition P, at input x:
///   y_o(x) = value_o + slope_o . (x_r - centre_r)
/// with the local model of the leaf of P whose box holds x, and x_r the regression inputs. The boxes cover the whole
/// space: outside the training extent the nearest leaf's local model goes on, which is extrapolation; outside() tells
/// when and how far.
class Model {
 public:
  /// Throws std::invalid_argument naming the part that does not fit: no partition or node, an output served twice or
  /// not at all, children out of order, an index out of range, a shape, or a number that is not finite.
  Model(std::vector<InputColumn> inputs, std::vector<OutputColumn> outputs, std::vector<int> regression_inputs,
        std::vector<Partition> partitions);

  std::ptrdiff_t num_inputs() const { return std::ssize(inputs_); }
  std::ptrdiff_t num_outputs() const { return std::ssize(outputs_); }
  const std::vector<InputColumn>& inputs() const { return inputs_; }
  const std::vector<OutputColumn>& outputs() const { return outputs_; }
  const std::vector<int>& regression_inputs() const {
    return regression_inputs_;
  }  ///< columns that local models use, ascending
  const std::vector<Partition>& partitions() const { return partitions_; }

  /// Predictions, rows x outputs, for `inputs` (rows x inputs). Throws std::invalid_argument if the number of columns
  /// differs or a value is not finite. Same bytes at any number of threads (0: all).
  Eigen::MatrixXd predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads = 0) const;

  /// Which leaf holds each row, rows x partitions: positions in leaves(partition). Throws as predict().
  Eigen::MatrixXi leaf_of(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const;

  /// How far each row lies outside the training extent: the largest excess over the inputs, as a multiple of that
  /// input's training range; 0 inside, infinity where an input that never varied differs. Throws as predict().
  Eigen::VectorXd outside(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const;

  /// The leaves of a partition from left to right in the tree. Throws std::invalid_argument if there is no such
  /// partition.
  std::vector<Leaf> leaves(std::ptrdiff_t partition) const;

  /// The model as it was when each partition had at most `max_leaves` leaves. Throws std::invalid_argument if
  /// max_leaves < 1.
  Model prefix(std::ptrdiff_t max_leaves) const;

  /// The same model with other column names. Throws std::invalid_argument if their numbers differ.
  Model named(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs) const;

 private:
  std::vector<InputColumn> inputs_;
  std::vector<OutputColumn> outputs_;
  std::vector<int> regression_inputs_;
  std::vector<Partition> partitions_;
};

/// Partition `partition` as it was with at most `max_leaves` leaves.
Partition prefix(const Partition& partition, std::ptrdiff_t max_leaves);

/// The model as JSON text, format version 1; docs/file-formats.md describes it. Numbers are written so that they read
/// back exactly.
std::string to_json(const Model& model);

/// Reads what to_json() wrote. Throws std::runtime_error, starting with `name`, that says which member is missing, has
/// the wrong type or shape, or holds a number that cannot be accepted, and for another format or version.
Model from_json(const std::string& text, const std::string& name = "model");

/// Writes to_json() to a file, through a temporary file beside it that is renamed at the end: a failed write leaves the
/// old file as it was. Throws std::runtime_error naming the path.
void save(const Model& model, const std::string& path);

/// Reads a file that save() wrote. Throws std::runtime_error naming the path.
Model load(const std::string& path);

}  // namespace llmt
