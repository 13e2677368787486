// Streams that learned apart, as one: docs/algorithms/stream.md, "Streams that merge".
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "llmt/stream.hpp"
#include "stream/state.hpp"

namespace llmt {

/// Rows of a leaf of another tree: all of them, or a part.
struct StreamPiece {
  const StreamSetting& setting;  ///< of the other tree
  const Basis& basis;            ///< of the leaf
  Eigen::MatrixXd gram;          ///< in this basis
  Eigen::Index rows;
  Eigen::VectorXd low;  ///< range of the inputs
  Eigen::VectorXd high;

  /// How many of the rows, in parts of 1, are not above a threshold: all or none where their range tells. Otherwise
  /// as if the input were uniform with its mean and variance.
  double part_up_to(int input, double threshold) const {
    if (high(input) <= threshold) return 1.0;
    if (low(input) > threshold) return 0.0;
    const double weight = gram(0, 0);
    const double mean = gram(input + 1, 0) / weight;
    const double variance = gram(input + 1, input + 1) / weight - mean * mean;
    const double reach = std::sqrt(3.0 * std::max(variance, 0.0));
    const double at = setting.scaled(input, threshold) - basis.origin(input) - mean;
    return reach > 0.0 ? std::clamp(0.5 + 0.5 * at / reach, 0.0, 1.0) : (at >= 0.0 ? 1.0 : 0.0);
  }

  StreamPiece share(double part, Eigen::Index of_rows) const {
    return {setting, basis, part * gram, of_rows, low, high};
  }
};

namespace {

// T of the features [1, z - c, y - f] in a basis as T times those in the basis of the piece.
Eigen::MatrixXd change_of_basis(const StreamPiece& piece, const StreamSetting& setting, const Basis& to) {
  const Eigen::Index inputs = setting.inputs;
  const Eigen::VectorXd ratio = piece.setting.scale.cwiseQuotient(setting.scale);
  const Eigen::VectorXd shift = (piece.setting.centre - setting.centre).cwiseQuotient(setting.scale) +
                                ratio.cwiseProduct(piece.basis.origin) - to.origin;
  const auto slopes = to.base.tail(inputs);
  Eigen::MatrixXd change = Eigen::MatrixXd::Identity(inputs + 2, inputs + 2);
  change.block(1, 1, inputs, inputs) = ratio.asDiagonal();
  change.block(1, 0, inputs, 1) = shift;
  change(inputs + 1, 0) = piece.basis.base(0) - to.base(0) - slopes.dot(shift);
  change.block(inputs + 1, 1, 1, inputs) = (piece.basis.base.tail(inputs) - ratio.cwiseProduct(slopes)).transpose();
  return change;
}

void add(const StreamPiece& piece, const StreamSetting& setting, const Basis& basis, Sums& sums) {
  const Eigen::MatrixXd change = change_of_basis(piece, setting, basis);
  const Eigen::MatrixXd gram = change * piece.gram * change.transpose();
  for (Eigen::Index i = 0; i < gram.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) sums.gram[setting.shape.at(i, j)] += gram(i, j);
  }
  sums.rows += piece.rows;
}

}  // namespace

void StreamTree::merge(const StreamTree& other, const LeafRows& learned) { merge(other, *other.root_, learned); }

void StreamTree::merge(const StreamTree& other, const StreamNode& branch, const LeafRows& learned) {
  if (!branch.is_leaf()) {
    for (const auto& child : branch.children) merge(other, *child, learned);
    return;
  }
  const auto found = learned.find(&branch);
  const Eigen::Index rows = branch.sums.rows - (found == learned.end() ? 0 : found->second);
  if (rows <= 0) return;
  const double part = static_cast<double>(rows) / static_cast<double>(branch.sums.rows);
  const Eigen::MatrixXd gram = part * matrix_of(setting_.shape, branch.sums.gram.data());
  take(*root_, {other.setting_, branch.basis, gram, rows, branch.low, branch.high});
}

void StreamTree::take(StreamNode& node, const StreamPiece& piece) {
  node.low = node.low.cwiseMin(piece.low);
  node.high = node.high.cwiseMax(piece.high);
  add(piece, setting_, node.basis, node.sums);
  if (node.is_leaf()) {
    node.solved_at = node.sums.rows;
    int rank = 0;
    node.model = own_model(setting_, node, rank);
    return;
  }
  const double part = piece.part_up_to(node.input, node.threshold);
  const auto rows = static_cast<Eigen::Index>(std::llround(part * static_cast<double>(piece.rows)));
  if (rows > 0) {
    StreamPiece left = piece.share(part, rows);
    left.high(node.input) = std::min(left.high(node.input), node.threshold);
    take(*node.children[0], left);
  }
  if (rows < piece.rows) {
    StreamPiece right = piece.share(1.0 - part, piece.rows - rows);
    right.low(node.input) = std::max(right.low(node.input), node.threshold);
    take(*node.children[1], right);
  }
}

void Reservoir::merge(const Reservoir& other) {
  for (const auto& [hash, row] : other.rows_) add(row.values.data(), row.times);
}

void StreamState::merge_columns(const StreamState& other) {
  for (Eigen::Index k = 0; k < inputs_ + outputs_; ++k) {
    if (other.known_(k) == 0.0) continue;
    ColumnRange& column = columns_[k];
    const ColumnRange& from = other.columns_[k];
    const bool is_first = known_(k) == 0.0;
    known_(k) += other.known_(k);
    column.low = is_first ? from.low : std::min(column.low, from.low);
    column.high = is_first ? from.high : std::max(column.high, from.high);
    column.mean += (from.mean - column.mean) * other.known_(k) / known_(k);
  }
  missing_ += other.missing_;
}

// Learns the rows of the other's reservoir that its trees have learned. Returns how many there are in each leaf.
std::vector<LeafRows> StreamState::learn_sample(const StreamState& other) {
  std::vector<LeafRows> rows_of(trees_.size());
  Eigen::VectorXd z(inputs_);
  for (const auto& [hash, row] : other.reservoir_.rows()) {
    if (row.held_out) continue;
    const double* const x = row.values.data();
    for (std::size_t o = 0; o < trees_.size(); ++o) {
      set_scaled(trees_[o]->setting(), x, z);
      trees_[o]->learn({x, z.data(), x[inputs_ + o], x[inputs_ + outputs_], reservoir_.different_fraction()});
      ++rows_of[o][&leaf_of(other.trees_[o]->root(), x)];
    }
  }
  return rows_of;
}

void StreamState::merge(const StreamState& other) {
  if (other.trees_.empty()) {
    const Eigen::Index count = std::ssize(other.first_rows_) / width();
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto begin = other.first_rows_.begin() + i * width();
      add({begin, begin + width()});
    }
    offered_ += other.offered_ - count;
    return;
  }
  merge_columns(other);
  reservoir_.merge(other.reservoir_);
  const std::vector<LeafRows> learned = learn_sample(other);
  for (std::size_t o = 0; o < trees_.size(); ++o) trees_[o]->merge(*other.trees_[o], learned[o]);
  if (other.tested_ > 0) {
    const double part = static_cast<double>(other.tested_) / static_cast<double>(tested_ + other.tested_);
    recent_ = tested_ == 0 ? other.recent_ : Eigen::VectorXd((1.0 - part) * recent_ + part * other.recent_);
  }
  squares_ += other.squares_;
  tested_ += other.tested_;
  offered_ += other.offered_;
  rows_ += other.rows_;
}

Stream merge(Stream first, Stream second) {
  const StreamState& a = *first.state_;
  const StreamState& b = *second.state_;
  if (a.inputs() != b.inputs() || a.outputs() != b.outputs()) {
    throw std::invalid_argument("llmt::merge: " + std::to_string(a.inputs()) + " inputs and " +
                                std::to_string(a.outputs()) + " outputs do not go with " + std::to_string(b.inputs()) +
                                " and " + std::to_string(b.outputs()));
  }
  if (!a.has_options_of(b)) throw std::invalid_argument("llmt::merge: the streams have different options");
  if (b.rows() > a.rows()) std::swap(first, second);
  first.state_->merge(*second.state_);
  return first;
}

}  // namespace llmt
