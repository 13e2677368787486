/// \file
/// One tree that learns from a stream.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "stream/search.hpp"
#include "stream/sums.hpp"

namespace llmt {

/// Whether absolute errors have risen: Page's (1954) cumulative sum, as Page-Hinkley tests have it, of errors as
/// multiples of what they used to be.
class RiseDetector {
 public:
  /// Takes an error; true if they have risen.
  bool add(double absolute_error);
  void reset() { *this = {}; }
  double usual() const { return usual_; }

 private:
  double usual_ = 0.0;  // mean of absolute errors, over about the last `memory`
  double excess_ = 0.0;
  Eigen::Index rows_ = 0;
};

/// Which of two models has had the smaller absolute errors lately.
class Duel {
 public:
  void add(double first, double second);
  Eigen::Index rows() const { return rows_; }
  /// Mean of first - second over its standard error.
  double t() const;

 private:
  double weight_ = 0.0;
  double mean_ = 0.0;
  double square_ = 0.0;
  Eigen::Index rows_ = 0;
};

/// Whether a threshold should move: of the rows beside it, how much larger the squared error of what is left of it is
/// than of what is right of it, in bins.
class ThresholdWatch {
 public:
  ThresholdWatch() = default;
  ThresholdWatch(double threshold, double reach) : threshold_(threshold), reach_(reach) {}

  bool concerns(double x) const { return std::abs(x - threshold_) < reach_; }

  /// Squared errors of both sides on a row beside the threshold, before it is learned; the threshold from now on.
  double add(double x, double squared_left, double squared_right);

 private:
  static constexpr std::size_t half = 16;  // bins on either side
  double threshold_ = 0.0;
  double reach_ = 0.0;
  Eigen::Index rows_ = 0;
  std::array<double, 2 * half> sums_{};
  std::array<double, 2 * half> squares_{};
};

/// A node, leaf or inner; inner nodes keep their own sums.
struct StreamNode {
  Basis basis;
  Sums sums;              ///< leaf: of all its rows; inner: of those before `sides`
  Eigen::VectorXd model;  ///< constant and slopes in the basis' origin
  Eigen::Index solved_at = 0;
  Eigen::VectorXd low;  ///< range of the inputs over all its rows; low > high: no value yet
  Eigen::VectorXd high;
  std::unique_ptr<LeafSearch> search;  ///< leaves that may still be split

  int input = -1;
  double threshold = 0.0;
  ThresholdWatch watch;
  double gain = 0.0;          ///< of the split, see StreamSplit
  std::array<Sums, 2> sides;  ///< inner: rows of the epoch that went left and right
  Eigen::Index epoch = 0;     ///< its length: rows until the split is tested again
  std::array<std::unique_ptr<StreamNode>, 2> children;

  RiseDetector rise;
  std::unique_ptr<StreamNode> alternate;  ///< grows beside since an alarm
  Duel duel;

  bool is_leaf() const { return children[0] == nullptr; }
  Eigen::Index rows() const { return sums.rows + sides[0].rows + sides[1].rows; }
};

class StreamTree {
 public:
  /// `first_model`: constant and slopes in scaled units, which the root's rows are taken relative to.
  StreamTree(const StreamSetting& setting, const Eigen::VectorXd& first_model);

  struct Counts {
    Eigen::Index leaves = 1;
    Eigen::Index splits = 0;
    Eigen::Index prunes = 0;
    Eigen::Index drifts = 0;
    Eigen::Index replacements = 0;
  };

  /// Learns a row; returns the error of the prediction before.
  double learn(const StreamRow& row);
  double predict(const StreamRow& row) const;

  const StreamSetting& setting() const { return setting_; }
  const StreamNode& root() const { return *root_; }
  const Counts& counts() const { return counts_; }
  Eigen::Index bytes() const;

  /// Called where the models of a branch restart, with what tells whether inputs belong to it.
  std::function<void(const std::function<bool(const double* x)>&)> on_drift;

 private:
  static double predict(const StreamNode& top, const StreamRow& row);
  double learn(std::unique_ptr<StreamNode>& slot, const StreamRow& row, bool watched);
  void learn_leaf(StreamNode& leaf, const StreamRow& row);
  void split(StreamNode& leaf, const StreamSplit& found);
  void end_epoch(StreamNode& node, double different);
  void settle(std::unique_ptr<StreamNode>& slot);
  void restart(StreamNode& node) const;
  void recount();
  std::unique_ptr<StreamNode> make_node(Basis basis) const;

  StreamSetting setting_;
  RowProducts products_;
  ResidualSums residuals_;
  Counts counts_;
  Eigen::Index alarms_ = 0;
  std::unique_ptr<StreamNode> root_;
};

/// The model of a node's own rows, in its basis; `rank`: as of solve().
Eigen::VectorXd own_model(const StreamSetting& setting, const StreamNode& node, int& rank);

/// Sums of all rows of a node, in its basis.
Sums all_sums(const StreamSetting& setting, const StreamNode& node);

/// 0 left, 1 right; a missing value goes with the most rows.
inline std::size_t side_of(const StreamNode& node, double x) {
  if (x == x) return x <= node.threshold ? 0 : 1;
  return node.children[0]->rows() >= node.children[1]->rows() ? 0 : 1;
}

}  // namespace llmt
