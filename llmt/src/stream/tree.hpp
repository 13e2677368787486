/// \file
/// One tree that learns from a stream.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <map>
#include <memory>

#include "stream/node.hpp"
#include "stream/search.hpp"
#include "stream/setting.hpp"
#include "stream/sums.hpp"

namespace llmt {

struct StreamPiece;

/// Numbers of rows of leaves.
using LeafRows = std::map<const StreamNode*, Eigen::Index>;

/// The incremental tree of docs/algorithms/stream.md.
class StreamTree {
 public:
  /// `first_model`: constant and slopes in scaled units; the base of the root's basis.
  StreamTree(const StreamSetting& setting, const Eigen::VectorXd& first_model);

  struct Counts {
    Eigen::Index leaves = 1;
    Eigen::Index splits = 0;
    Eigen::Index prunes = 0;
    Eigen::Index drifts = 0;
    Eigen::Index replacements = 0;
  };

  /// Learns a row. Returns the error of the prediction before.
  double learn(const StreamRow& row);
  double predict(const StreamRow& row) const;

  /// Adds the rows that another tree learned, but for those of its leaves that this tree has learned since. Splits stay
  /// as they are.
  void merge(const StreamTree& other, const LeafRows& learned);

  const StreamSetting& setting() const { return setting_; }
  const StreamNode& root() const { return *root_; }
  const Counts& counts() const { return counts_; }
  Eigen::Index bytes() const;

  /// Called when the models of a branch restart. The argument tells whether a row of inputs belongs to the branch.
  std::function<void(const std::function<bool(const double* x)>&)> on_drift;

 private:
  friend struct StreamJson;
  double learn(std::unique_ptr<StreamNode>& slot, const StreamRow& row, bool watched);
  double learn_inner(StreamNode& node, const StreamRow& row, bool watched);
  void learn_leaf(StreamNode& leaf, const StreamRow& row);
  void raise_alarm(StreamNode& node);
  void split(StreamNode& leaf, const StreamSplit& found);
  std::unique_ptr<StreamNode> make_child(const StreamNode& parent, const Eigen::VectorXd& change,
                                         const Sums& sums) const;
  void end_epoch(StreamNode& node, double different);
  bool is_needed(const Sums& both, const std::array<Sums, 2>& sides, double different);
  void undo_split(StreamNode& node);
  void settle(std::unique_ptr<StreamNode>& slot);
  void restart(StreamNode& node) const;
  void recount();
  void merge(const StreamTree& other, const StreamNode& branch, const LeafRows& learned);
  void take(StreamNode& node, const StreamPiece& piece);
  std::unique_ptr<StreamNode> make_node(Basis basis) const;

  StreamSetting setting_;
  RowProducts products_;
  ResidualSums residuals_;
  Counts counts_;
  std::unique_ptr<StreamNode> root_;
};

}  // namespace llmt
