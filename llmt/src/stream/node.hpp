/// \file
/// The nodes of a stream's tree.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>

#include "stream/detectors.hpp"
#include "stream/search.hpp"
#include "stream/setting.hpp"
#include "stream/sums.hpp"

namespace llmt {

/// A node, leaf or inner; inner nodes keep their own sums.
struct StreamNode {
  Basis basis;
  Sums sums;                   ///< leaf: of all its rows; inner: of the rows before those in `sides`
  Eigen::VectorXd model;       ///< constant and slopes about the origin of the basis
  Eigen::Index solved_at = 0;  ///< number of rows when the model was solved for
  Eigen::VectorXd low;         ///< range of the inputs over all its rows; low > high: no value yet
  Eigen::VectorXd high;
  std::unique_ptr<LeafSearch> search;  ///< only in leaves that may still be split

  int input = -1;  ///< of the split; -1 in a leaf
  double threshold = 0.0;
  ThresholdWatch watch;
  double gain = 0.0;          ///< of the split, see StreamSplit
  std::array<Sums, 2> sides;  ///< inner: rows of the epoch that went left and right
  Eigen::Index epoch = 0;     ///< number of rows after which the split is tested again
  std::array<std::unique_ptr<StreamNode>, 2> children;

  RiseDetector rise;
  std::unique_ptr<StreamNode> alternate;  ///< the tree that has grown beside this branch since an alarm
  Duel duel;                              ///< between the branch and its alternate

  bool is_leaf() const { return children[0] == nullptr; }
  Eigen::Index rows() const { return sums.rows + sides[0].rows + sides[1].rows; }
};

/// The child that a value of the split input belongs to: 0 left, 1 right. A missing value goes with the most rows.
inline std::size_t side_of(const StreamNode& node, double x) {
  if (x == x) return x <= node.threshold ? 0 : 1;
  return node.children[0]->rows() >= node.children[1]->rows() ? 0 : 1;
}

/// The prediction of a node's own model.
double value_of(const StreamNode& node, const double* z);

/// The leaf below a node that a row of inputs belongs to.
const StreamNode& leaf_of(const StreamNode& top, const double* x);

/// The prediction of the tree below a node.
double predict(const StreamNode& top, const StreamRow& row);

/// The sums of all rows of a node, in its basis.
Sums all_sums(const StreamSetting& setting, const StreamNode& node);

/// The model of all rows of a node, in its basis. `rank`: as of solve().
Eigen::VectorXd own_model(const StreamSetting& setting, const StreamNode& node, int& rank);

/// Leaves of the tree below a node, alternates included.
Eigen::Index leaves_of(const StreamNode& node);

/// Bytes that the tree below a node takes.
Eigen::Index bytes_of(const StreamNode& node);

}  // namespace llmt
