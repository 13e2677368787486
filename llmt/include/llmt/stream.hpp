/// \file
/// Local linear model trees from a stream of rows, in memory that does not depend on the number of rows.
///
///     llmt::Stream stream(inputs.cols(), outputs.cols());
///     stream.add(inputs, outputs);  // as often as rows come
///     const Eigen::MatrixXd predicted = stream.snapshot().predict(new_inputs);
///     llmt::Stream later = llmt::stream_from_json(to_json(stream));  // goes on as the first one does
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "llmt/abi.hpp"
#include "llmt/model.hpp"
#include "llmt/options.hpp"
#include "llmt/stream_options.hpp"

namespace llmt {

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
///
/// Threads: members that are const, and to_json(), may be called on several threads at a time. add(), merge() and
/// assignment need the stream for themselves: who shares a stream that learns holds a lock around every call.
class Stream {
 public:
  /// Throws std::invalid_argument naming field, value and bound if there is no input or output, or an option is out of
  /// range, and std::runtime_error if the sums of one leaf, which grow with the square of the inputs, need more memory
  /// than the machine has.
  Stream(Eigen::Index num_inputs, Eigen::Index num_outputs, const StreamOptions& options = {});
  ~Stream();
  Stream(Stream&&) noexcept;
  Stream& operator=(Stream&&) noexcept;

  /// Learns from rows in their order. inputs: rows x inputs; outputs: rows x outputs; weights: one per row, from 0 to
  /// 1e150, or empty. Throws std::invalid_argument, and learns nothing, if a shape differs, an input is infinite, an
  /// output is not finite, a magnitude is above 1e150 or a weight is negative or no number, naming the row of this call
  /// and of the stream.
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
  friend Stream merge(Stream first, Stream second);
  friend std::string to_json(const Stream& stream);
  friend Stream stream_from_json(const std::string& text, const std::string& name);

  std::unique_ptr<StreamState> state_;
};

/// What two streams learned from different rows, as one stream: shards may be learned apart, on any machine. The
/// splits are those of the stream with more rows (of `first` if they have equally many). To each of its leaves the
/// sums of the other's leaves are added: exactly where these lie in it, shared out where a split crosses them
/// (docs/algorithms/stream.md). Throws std::invalid_argument if inputs, outputs or options differ.
Stream merge(Stream first, Stream second);

/// Everything that a stream needs to go on, as JSON text (docs/file-formats.md): trees with their sums, rows that are
/// kept, what is known of changes under way. All digits of numbers are kept. It takes about 20 bytes for each number of
/// 8 bytes that StreamCounts::bytes counts.
std::string to_json(const Stream& stream);

/// The stream that to_json() wrote. Given the same rows it goes on to the same bytes as the stream that was written.
/// `name` stands before the place in errors. Throws std::runtime_error `name: /trees/0/nodes/3/low: ...` if the text is
/// cut off or no JSON, or if a member is missing or contradicts others.
Stream stream_from_json(const std::string& text, const std::string& name = "stream");

}  // namespace llmt
