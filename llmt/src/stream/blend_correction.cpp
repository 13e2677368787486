#include "stream/blend_correction.hpp"

#include <algorithm>
#include <cmath>

#include "model/tree.hpp"

namespace llmt {
namespace {

constexpr int most_steps = 15;
constexpr double enough = 1e-5;  // of the squared gradient

}  // namespace

BlendCorrection::BlendCorrection(const TrainingRows& rows, Partition blended)
    : partition_(std::move(blended)),
      size_(std::ssize(rows.regressors) + 1),
      scale_(rows.scale),
      residuals_(rows.count()) {
  std::vector<int> position(partition_.nodes.size(), -1);
  for (std::size_t i = 0; i < partition_.nodes.size(); ++i) {
    if (partition_.nodes[i].is_leaf()) {
      position[i] = static_cast<int>(leaves_.size());
      leaves_.push_back(static_cast<int>(i));
    }
  }
  grams_.assign(leaves_.size(), Eigen::MatrixXd::Zero(size_, size_));
  const Evaluator evaluator(partition_, rows.columns, size_ - 1);
  const std::vector<int> parents = parents_of(partition_);
  std::vector<Activation> active;
  Eigen::Index at = 0;
  begins_.push_back(0);
  regressors_.resize(size_, rows.count());
  for (Eigen::Index index = 0; index < num_chunks(rows); ++index) {
    const Chunk chunk = fetch(rows, index, partition_.outputs);
    for (Eigen::Index r = 0; r < chunk.count(); ++r, ++at) {
      const double root = std::sqrt(chunk.weights(r));
      evaluator.activate(chunk.inputs.row(r).data(), active);
      const Activation& largest = *std::max_element(
          active.begin(), active.end(), [](const auto& l, const auto& m) { return l.validity < m.validity; });
      const Eigen::VectorXd& mean = partition_.nodes[largest.node].mean;
      const Eigen::VectorXd given = chunk.deviations.row(r).transpose();
      const Eigen::VectorXd deviations = given.array().isNaN().select(mean, given);
      auto a = regressors_.col(at);
      a(0) = root;
      a.tail(size_ - 1) = root * deviations.cwiseQuotient(scale_);
      double value = chunk.outputs(r, 0);
      for (const Activation& entry : active) {
        Node& node = partition_.nodes[entry.node];
        node.low = node.low.cwiseMin(deviations);
        node.high = node.high.cwiseMax(deviations);
        value -= entry.validity * (node.value(0) + node.slope.row(0).dot(deviations));
        const int leaf = position[entry.node];
        positions_.push_back(leaf);
        validities_.push_back(entry.validity);
        grams_[leaf].selfadjointView<Eigen::Lower>().rankUpdate(a, entry.validity);
      }
      residuals_(at) = root * value;
      begins_.push_back(static_cast<int>(positions_.size()));
    }
  }
  for (Eigen::MatrixXd& gram : grams_) {
    gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  }
  for (std::size_t i = partition_.nodes.size(); i-- > 1;) {
    Node& parent = partition_.nodes[parents[i]];
    parent.low = parent.low.cwiseMin(partition_.nodes[i].low);
    parent.high = parent.high.cwiseMax(partition_.nodes[i].high);
  }
}

// A'A change, A the rows of Phi_i a.
Eigen::VectorXd BlendCorrection::apply(const Eigen::VectorXd& change) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(change.size());
  for (std::size_t row = 0; row + 1 < begins_.size(); ++row) {
    const auto a = regressors_.col(row);
    double value = 0.0;
    for (int e = begins_[row]; e < begins_[row + 1]; ++e) {
      value += validities_[e] * a.dot(change.segment(positions_[e] * size_, size_));
    }
    for (int e = begins_[row]; e < begins_[row + 1]; ++e) {
      result.segment(positions_[e] * size_, size_) += validities_[e] * value * a;
    }
  }
  return result;
}

Partition BlendCorrection::corrected(double ridge) const {
  const Eigen::Index leaves = std::ssize(leaves_);
  std::vector<Eigen::LLT<Eigen::MatrixXd>> blocks;
  std::vector<Eigen::VectorXd> holds;
  for (const Eigen::MatrixXd& gram : grams_) {
    // Directions without rows stay as they are.
    holds.emplace_back((1e-6 * gram.diagonal()).array() + 1e-9);
    blocks.emplace_back((1.0 + ridge) * gram + Eigen::MatrixXd(holds.back().asDiagonal()));
  }
  const auto precondition = [&](const Eigen::VectorXd& from) {
    Eigen::VectorXd to(from.size());
    for (Eigen::Index i = 0; i < leaves; ++i) {
      to.segment(i * size_, size_) = blocks[i].solve(from.segment(i * size_, size_));
    }
    return to;
  };
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(leaves * size_);
  for (std::size_t row = 0; row + 1 < begins_.size(); ++row) {
    for (int e = begins_[row]; e < begins_[row + 1]; ++e) {
      residual.segment(positions_[e] * size_, size_) += validities_[e] * residuals_(row) * regressors_.col(row);
    }
  }
  Eigen::VectorXd change = Eigen::VectorXd::Zero(leaves * size_);
  Eigen::VectorXd conditioned = precondition(residual);
  Eigen::VectorXd direction = conditioned;
  double now = residual.dot(conditioned);
  const double first = now;
  for (int step = 0; step < most_steps && now > enough * first; ++step) {
    Eigen::VectorXd product = apply(direction);
    for (Eigen::Index i = 0; i < leaves; ++i) {
      const auto of_leaf = direction.segment(i * size_, size_);
      product.segment(i * size_, size_) += ridge * (grams_[i] * of_leaf) + holds[i].cwiseProduct(of_leaf);
    }
    const double curvature = direction.dot(product);
    if (!(curvature > 0.0)) break;
    change += now / curvature * direction;
    residual -= now / curvature * product;
    conditioned = precondition(residual);
    const double next = residual.dot(conditioned);
    direction = conditioned + next / now * direction;
    now = next;
  }
  Partition result = partition_;
  for (Eigen::Index i = 0; i < leaves; ++i) {
    Node& node = result.nodes[leaves_[i]];
    const auto of_leaf = change.segment(i * size_, size_);
    node.value(0) += of_leaf(0);
    node.slope.row(0) += of_leaf.tail(size_ - 1).cwiseQuotient(scale_).transpose();
  }
  return result;
}

}  // namespace llmt
