// Streams that learned apart, as one: docs/algorithms/stream.md, "Streams that merge".
#include <algorithm>
#include <array>
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
  Eigen::VectorXd change;        ///< of the leaf's model from the base of the basis
  Eigen::MatrixXd gram;          ///< in the basis
  Eigen::Index rows;
  Eigen::VectorXd low;  ///< range of the inputs
  Eigen::VectorXd high;

  /// The rows on either side of a threshold, eq. (T.4); all on one side where their range says so.
  std::array<StreamPiece, 2> split(int input, double threshold) const {
    if (high(input) <= threshold) return {*this, share(0.0, 0.0 * gram)};
    if (low(input) > threshold) return {share(0.0, 0.0 * gram), *this};
    const double mean = gram(input + 1, 0) / gram(0, 0);
    const double variance = gram(input + 1, input + 1) / gram(0, 0) - mean * mean;
    const double reach = std::sqrt(3.0 * std::max(variance, 0.0));
    const double at = setting.scaled(input, threshold) - basis.origin(input) - mean;
    const double below = reach > 0.0 ? std::clamp(0.5 + 0.5 * at / reach, 0.0, 1.0) : (at >= 0.0 ? 1.0 : 0.0);
    const double above = 1.0 - below;
    std::array<StreamPiece, 2> sides = {share(below, below * moved(input, below, mean, -reach * above)),
                                        share(above, above * moved(input, above, mean, reach * below))};
    sides[1].rows = rows - sides[0].rows;
    sides[0].high(input) = sides[1].low(input) = threshold;
    return sides;
  }

 private:
  StreamPiece share(double part, Eigen::MatrixXd of_gram) const {
    const auto count = static_cast<Eigen::Index>(std::llround(part * static_cast<double>(rows)));
    return {setting, basis, change, std::move(of_gram), count, low, high};
  }

  /// The Gram matrix when the input's deviations from its mean are multiplied by `factor`, its mean moves by `shift`,
  /// and the output follows the leaf's model.
  Eigen::MatrixXd moved(int input, double factor, double mean, double shift) const {
    const Eigen::Index residual = gram.rows() - 1;
    Eigen::MatrixXd to = Eigen::MatrixXd::Identity(gram.rows(), gram.cols());
    to(input + 1, input + 1) = factor;
    to(input + 1, 0) = (1.0 - factor) * mean + shift;
    to(residual, input + 1) = change(input + 1) * (factor - 1.0);
    to(residual, 0) = change(input + 1) * to(input + 1, 0);
    return to * gram * to.transpose();
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
  const Eigen::VectorXd change = branch.model - branch.basis.base;
  take(*root_, {other.setting_, branch.basis, change, gram, rows, branch.low, branch.high});
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
  const std::array<StreamPiece, 2> sides = piece.split(node.input, node.threshold);
  for (std::size_t side = 0; side < 2; ++side) {
    if (sides[side].rows > 0) take(*node.children[side], sides[side]);
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
