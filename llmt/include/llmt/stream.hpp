/// \file
/// Local linear model trees from a stream of rows, in memory that does not depend on the number of rows.
///
///     llmt::Stream stream(inputs.cols(), outputs.cols());
///     stream.add(inputs, outputs);  // as often as rows come
///     const Eigen::MatrixXd predicted = stream.snapshot().predict(new_inputs);
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "llmt/abi.hpp"
#include "llmt/model.hpp"
#include "llmt/options.hpp"

namespace llmt {

struct StreamOptions {
  /// Upper bound of the probability that a leaf whose rows follow one linear model with normal noise is ever split. The
  /// level of a single test is this divided by the number of candidate splits and shared out over the repeated tests.
  double significance = 0.05;
  /// Smallest decrease of the residual variance by a split, as a fraction of the variance of the output.
  double min_variance_gain = 0.0;
  Eigen::Index min_leaf_samples = 0;  ///< on either side of a split. 0: twice the coefficients of a local model
  /// Largest number of leaves of each tree, which bounds memory. 0: the number whose sums take about 64 MiB, within
  /// 16 ... 500; fewer where 16 leaves would take more than 1 GiB (about 100 inputs), 1 from about 250 inputs on.
  Eigen::Index max_leaves = 0;
  int bins = 16;  ///< bins of an input in a leaf, 4 ... 256
  /// A leaf's model is drawn to the model that its parent had when it was split, as if this many further rows of the
  /// leaf lay on it.
  double shrinkage = 0.1;
  /// Rows that are kept. One in eight is held out: these choose crisp or blended leaves and the leaf count of a
  /// snapshot. The others estimate blends. 0: a snapshot is the crisp tree as it stands.
  Eigen::Index reservoir_rows = 20000;
};

/// What a stream has seen and done so far.
struct StreamCounts {
  Eigen::Index rows = 0;            ///< of positive weight
  Eigen::Index missing_values = 0;  ///< in the inputs
  Eigen::Index held_out = 0;        ///< rows in the reservoir that no tree has learned from
  Eigen::Index leaves = 0;          ///< of all trees
  Eigen::Index max_leaves = 0;      ///< of each tree, as used
  Eigen::Index splits = 0;
  Eigen::Index prunes = 0;        ///< splits taken back because recent rows do not need them
  Eigen::Index drifts = 0;        ///< alarms: branches whose errors rose abruptly and whose models restarted
  Eigen::Index replacements = 0;  ///< branches that a new one, grown from the alarm on, has replaced
  Eigen::Index bytes = 0;         ///< memory of sums, models and reservoir
};

class StreamState;

/// A tree for every output that learns from rows as they come: each row is seen once and forgotten.
///
/// Splits are found by residual differences (Potts & Sammut 2005; docs/algorithms.md): every leaf keeps the sums of
/// squares and products of its rows in bins of every input, so that the residual sums of squares of both sides of every
/// edge between bins are known exactly; the best edge must pass the F test of Chow (1960).
///
/// A leaf's model is the least-squares fit of all rows that reached it since its branch began, including those that its
/// parent counted on its side of the split. A split is taken back when recent rows no longer need it. Where the errors
/// of a branch rise abruptly, its models start anew and a new branch grows beside it. The same rows in the same order
/// give the same bytes, added one at a time or in blocks. To go over data several times, add them again.
///
/// Inputs may be missing (NaN): such a row follows the side with more rows and counts in a local model with the leaf's
/// mean. Inputs are numbers; categories are not supported.
class Stream {
 public:
  /// Throws std::invalid_argument naming field, value and bound if there is no input or output, or an option is out of
  /// range.
  Stream(Eigen::Index num_inputs, Eigen::Index num_outputs, const StreamOptions& options = {});
  ~Stream();
  Stream(Stream&&) noexcept;
  Stream& operator=(Stream&&) noexcept;

  /// Learns from rows in their order. inputs: rows x inputs; outputs: rows x outputs; weights: one per row, not
  /// negative, or empty. Throws std::invalid_argument, and learns nothing, if a shape differs, an input is infinite, an
  /// output or weight is not finite or a weight is negative, naming the row of this call and of the stream.
  void add(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
           const Eigen::Ref<const Eigen::VectorXd>& weights = Eigen::VectorXd());

  /// What the crisp trees say now, rows x outputs; the means of the outputs during the first rows, NaN before any.
  Eigen::MatrixXd predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const;

  /// Root mean square of the errors on every row before it was learned from (test then train), one per output: over all
  /// rows but the first few, and over about the last 1000. NaN before.
  Eigen::VectorXd prequential_rmse() const;
  Eigen::VectorXd recent_rmse() const;

  StreamCounts counts() const;

  /// The model as it stands. `automatic`: crisp or a blend, with the number of leaves that predicts the held-out rows
  /// best; `crisp`, `blend`: the same among these alone. Throws std::invalid_argument if there is no row yet, and for
  /// `gaussian`.
  Model snapshot(ValidityChoice validity = ValidityChoice::automatic) const;

 private:
  std::unique_ptr<StreamState> state_;
};

}  // namespace llmt
