#include "stream/blend_correction.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/count.hpp"
#include "model/imputed.hpp"
#include "model/tree.hpp"
#include "numerics/conjugate_gradients.hpp"

namespace llmt {
namespace {

// Conjugate gradients end after 15 steps, or when the squared preconditioned gradient is below 1e-5 of its first value.
constexpr int most_steps = 15;
constexpr double enough = 1e-5;

// Added to the diagonal of each leaf's matrix: relative to it, and in rows. So directions without rows stay as they
// are.
constexpr double relative_diagonal = 1e-6;
constexpr double least_diagonal = 1e-9;

}  // namespace

BlendCorrection::BlendCorrection(const TrainingRows& rows, Partition blended)
    : partition_(std::move(blended)),
      size_(std::ssize(rows.regressors) + 1),
      scale_(rows.scale),
      position_(partition_.nodes.size(), -1),
      begins_({0}),
      regressors_(size_, rows.count()),
      residuals_(rows.count()) {
  for (int i = 0; i < std::ssize(partition_.nodes); ++i) {
    if (partition_.nodes[i].is_leaf()) {
      position_[i] = count_of(leaves_);
      leaves_.push_back(i);
    }
  }
  grams_.assign(leaves_.size(), Eigen::MatrixXd::Zero(size_, size_));
  const Evaluator evaluator(partition_, rows.columns, size_ - 1);
  std::vector<Activation> active;
  for (Eigen::Index index = 0; index < num_chunks(rows); ++index) {
    const Chunk chunk = fetch(rows, index, partition_.outputs);
    for (Eigen::Index row = 0; row < chunk.count(); ++row) {
      add_row(evaluator, chunk, row, active);
    }
  }
  for (Eigen::MatrixXd& gram : grams_) {
    gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  }
  const std::vector<int> parents = parents_of(partition_);
  for (std::size_t i = partition_.nodes.size(); i-- > 1;) {
    Node& parent = partition_.nodes[parents[i]];
    parent.low = parent.low.cwiseMin(partition_.nodes[i].low);
    parent.high = parent.high.cwiseMax(partition_.nodes[i].high);
  }
}

void BlendCorrection::add_row(const Evaluator& evaluator, const Chunk& chunk, Eigen::Index row,
                              std::vector<Activation>& active) {
  const Eigen::Index at = std::ssize(begins_) - 1;
  const double root = std::sqrt(chunk.weights(row));
  evaluator.activate(chunk.inputs.row(row).data(), active);
  const Activation& largest = *std::ranges::max_element(active, {}, &Activation::validity);
  const Eigen::VectorXd deviations = imputed(partition_.nodes[largest.node], chunk.deviations.row(row));
  auto a = regressors_.col(at);
  a(0) = root;
  a.tail(size_ - 1) = root * deviations.cwiseQuotient(scale_);
  double value = chunk.outputs(row, 0);
  for (const Activation& entry : active) {
    Node& node = partition_.nodes[entry.node];
    node.low = node.low.cwiseMin(deviations);
    node.high = node.high.cwiseMax(deviations);
    value -= entry.validity * (node.value(0) + node.slope.row(0).dot(deviations));
    const int leaf = position_[entry.node];
    positions_.push_back(leaf);
    validities_.push_back(entry.validity);
    grams_[leaf].selfadjointView<Eigen::Lower>().rankUpdate(a, entry.validity);
  }
  residuals_(at) = root * value;
  begins_.push_back(count_of(positions_));
}

// A' A change, where A has a row Phi_i a for every row of the data.
Eigen::MatrixXd BlendCorrection::times_normal_matrix(const Eigen::MatrixXd& change) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(change.rows(), 1);
  for (std::size_t row = 0; row + 1 < begins_.size(); ++row) {
    const auto a = regressors_.col(row);
    double value = 0.0;
    for (int e = begins_[row]; e < begins_[row + 1]; ++e) {
      value += validities_[e] * a.dot(change.col(0).segment(positions_[e] * size_, size_));
    }
    for (int e = begins_[row]; e < begins_[row + 1]; ++e) {
      result.col(0).segment(positions_[e] * size_, size_) += validities_[e] * value * a;
    }
  }
  return result;
}

// A' residuals.
Eigen::MatrixXd BlendCorrection::gradient() const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(std::ssize(leaves_) * size_, 1);
  for (std::size_t row = 0; row + 1 < begins_.size(); ++row) {
    for (int e = begins_[row]; e < begins_[row + 1]; ++e) {
      result.col(0).segment(positions_[e] * size_, size_) += validities_[e] * residuals_(row) * regressors_.col(row);
    }
  }
  return result;
}

Partition BlendCorrection::corrected(double ridge) const {
  const Eigen::Index leaves = std::ssize(leaves_);
  std::vector<Eigen::LLT<Eigen::MatrixXd>> blocks;
  std::vector<Eigen::VectorXd> diagonals;
  for (const Eigen::MatrixXd& gram : grams_) {
    diagonals.emplace_back((relative_diagonal * gram.diagonal()).array() + least_diagonal);
    blocks.emplace_back((1.0 + ridge) * gram + Eigen::MatrixXd(diagonals.back().asDiagonal()));
  }
  const auto precondition = [&](const Eigen::MatrixXd& from) {
    Eigen::MatrixXd to(from.rows(), 1);
    for (Eigen::Index i = 0; i < leaves; ++i) {
      to.col(0).segment(i * size_, size_) = blocks[i].solve(from.col(0).segment(i * size_, size_));
    }
    return to;
  };
  const auto multiply = [&](const Eigen::MatrixXd& change) {
    Eigen::MatrixXd product = times_normal_matrix(change);
    for (Eigen::Index i = 0; i < leaves; ++i) {
      const auto of_leaf = change.col(0).segment(i * size_, size_);
      product.col(0).segment(i * size_, size_) += ridge * (grams_[i] * of_leaf) + diagonals[i].cwiseProduct(of_leaf);
    }
    return product;
  };
  Eigen::MatrixXd change = Eigen::MatrixXd::Zero(leaves * size_, 1);
  conjugate_gradients(multiply, precondition, most_steps, enough, gradient(), change);
  Partition result = partition_;
  for (Eigen::Index i = 0; i < leaves; ++i) {
    Node& node = result.nodes[leaves_[i]];
    const auto of_leaf = change.col(0).segment(i * size_, size_);
    node.value(0) += of_leaf(0);
    node.slope.row(0) += of_leaf.tail(size_ - 1).cwiseQuotient(scale_).transpose();
  }
  return result;
}

}  // namespace llmt
