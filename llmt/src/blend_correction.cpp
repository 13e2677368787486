#include "blend_correction.hpp"

#include <algorithm>
#include <cmath>

#include "boxes.hpp"

namespace llmt {
namespace {

constexpr int most_steps = 30;
constexpr double enough = 1e-8;  // of the squared gradient

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
  Eigen::VectorXd a(size_);
  std::ptrdiff_t at = 0;
  begins_.push_back(0);
  for (std::ptrdiff_t index = 0; index < num_chunks(rows); ++index) {
    const Chunk chunk = fetch(rows, index, partition_.outputs);
    for (std::ptrdiff_t r = 0; r < chunk.count(); ++r, ++at) {
      const double root = std::sqrt(chunk.weights(r));
      evaluator.activate(chunk.inputs.row(r).data(), active);
      double value = chunk.outputs(r, 0);
      for (const Activation& entry : active) {
        Node& node = partition_.nodes[static_cast<std::size_t>(entry.node)];
        a(0) = 1.0;
        double model = node.value(0);
        for (std::ptrdiff_t k = 0; k + 1 < size_; ++k) {
          const double deviation = chunk.deviations(r, k);
          if (!std::isnan(deviation)) {
            node.low(k) = std::min(node.low(k), deviation);
            node.high(k) = std::max(node.high(k), deviation);
          }
          const double held = std::isnan(deviation) ? node.mean(k) : deviation;
          model += node.slope(0, k) * held;
          a(k + 1) = held / scale_(k);
        }
        value -= entry.validity * model;
        const int leaf = position[static_cast<std::size_t>(entry.node)];
        positions_.push_back(leaf);
        validities_.push_back(entry.validity);
        a *= root;
        regressors_.insert(regressors_.end(), a.begin(), a.end());
        grams_[static_cast<std::size_t>(leaf)].noalias() += entry.validity * a * a.transpose();
      }
      residuals_(at) = root * value;
      begins_.push_back(static_cast<int>(positions_.size()));
    }
  }
  for (std::size_t i = partition_.nodes.size(); i-- > 1;) {
    Node& parent = partition_.nodes[static_cast<std::size_t>(parents[i])];
    parent.low = parent.low.cwiseMin(partition_.nodes[i].low);
    parent.high = parent.high.cwiseMax(partition_.nodes[i].high);
  }
}

/// A'A change, A the rows of Phi_i a.
Eigen::VectorXd BlendCorrection::apply(const Eigen::VectorXd& change) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(change.size());
  for (std::size_t row = 0; row + 1 < begins_.size(); ++row) {
    double value = 0.0;
    for (int e = begins_[row]; e < begins_[row + 1]; ++e) {
      const Eigen::Map<const Eigen::VectorXd> a(regressors_.data() + e * size_, size_);
      value += validities_[static_cast<std::size_t>(e)] *
               a.dot(change.segment(positions_[static_cast<std::size_t>(e)] * size_, size_));
    }
    for (int e = begins_[row]; e < begins_[row + 1]; ++e) {
      const Eigen::Map<const Eigen::VectorXd> a(regressors_.data() + e * size_, size_);
      result.segment(positions_[static_cast<std::size_t>(e)] * size_, size_) +=
          validities_[static_cast<std::size_t>(e)] * value * a;
    }
  }
  return result;
}

Partition BlendCorrection::corrected(double ridge) const {
  const std::ptrdiff_t leaves = std::ssize(leaves_);
  std::vector<Eigen::LLT<Eigen::MatrixXd>> blocks;
  std::vector<Eigen::VectorXd> holds;
  for (const Eigen::MatrixXd& gram : grams_) {
    // Directions without rows stay as they are.
    holds.push_back((1e-6 * gram.diagonal()).array() + 1e-9);
    blocks.emplace_back((1.0 + ridge) * gram + Eigen::MatrixXd(holds.back().asDiagonal()));
  }
  const auto precondition = [&](const Eigen::VectorXd& from) {
    Eigen::VectorXd to(from.size());
    for (std::ptrdiff_t i = 0; i < leaves; ++i) {
      to.segment(i * size_, size_) = blocks[static_cast<std::size_t>(i)].solve(from.segment(i * size_, size_));
    }
    return to;
  };
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(leaves * size_);
  for (std::size_t row = 0; row + 1 < begins_.size(); ++row) {
    for (int e = begins_[row]; e < begins_[row + 1]; ++e) {
      residual.segment(positions_[static_cast<std::size_t>(e)] * size_, size_) +=
          validities_[static_cast<std::size_t>(e)] * residuals_(static_cast<std::ptrdiff_t>(row)) *
          Eigen::Map<const Eigen::VectorXd>(regressors_.data() + e * size_, size_);
    }
  }
  Eigen::VectorXd change = Eigen::VectorXd::Zero(leaves * size_);
  Eigen::VectorXd conditioned = precondition(residual);
  Eigen::VectorXd direction = conditioned;
  double now = residual.dot(conditioned);
  const double first = now;
  for (int step = 0; step < most_steps && now > enough * first; ++step) {
    Eigen::VectorXd product = apply(direction);
    for (std::ptrdiff_t i = 0; i < leaves; ++i) {
      const auto of_leaf = direction.segment(i * size_, size_);
      product.segment(i * size_, size_) += ridge * (grams_[static_cast<std::size_t>(i)] * of_leaf) +
                                           holds[static_cast<std::size_t>(i)].cwiseProduct(of_leaf);
    }
    const double curvature = direction.dot(product);
    if (!(curvature > 0.0)) {
      break;
    }
    change += now / curvature * direction;
    residual -= now / curvature * product;
    conditioned = precondition(residual);
    const double next = residual.dot(conditioned);
    direction = conditioned + next / now * direction;
    now = next;
  }
  Partition result = partition_;
  for (std::ptrdiff_t i = 0; i < leaves; ++i) {
    Node& node = result.nodes[static_cast<std::size_t>(leaves_[static_cast<std::size_t>(i)])];
    const auto of_leaf = change.segment(i * size_, size_);
    node.value(0) += of_leaf(0);
    node.slope.row(0) += of_leaf.tail(size_ - 1).cwiseQuotient(scale_).transpose();
  }
  return result;
}

}  // namespace llmt
