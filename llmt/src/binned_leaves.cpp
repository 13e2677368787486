#include "binned_leaves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace llmt {
namespace {

/// Histograms of leaves that wait may take this part of what the features take, and at least as much as this many
/// nodes.
constexpr std::ptrdiff_t kept_part = 4;
constexpr std::ptrdiff_t kept_nodes = 8;

/// A node with so small a part of the sum of squares that the features hold gets features of its own residuals.
constexpr double digits_at_risk = 1e-4;

}  // namespace

bool BinnedLeaves::possible(const GrowthData& data) {
  const bool few_levels =
      std::all_of(data.num_levels.begin(), data.num_levels.end(), [](int levels) { return levels <= most_bins; });
  const auto complete = [&](int input) { return !data.training.table->inputs.col(input).hasNaN(); };
  const std::vector<int>& inputs = data.problem.options.split_inputs;
  return few_levels && !data.training.has_missing && std::all_of(inputs.begin(), inputs.end(), complete);
}

BinnedLeaves::BinnedLeaves(const GrowthData& data)
    : data_(data),
      rows_(data),
      memory_left_(std::max(rows_.features().rows() * rows_.features().columns() / kept_part,
                            kept_nodes * rows_.num_bins() * rows_.shape().size())) {}

BinnedLeaf BinnedLeaves::root() const {
  BinnedLeaf leaf;
  leaf.rows.resize(static_cast<std::size_t>(data_.training.count()));
  std::iota(leaf.rows.begin(), leaf.rows.end(), 0);
  leaf.histogram = rows_.accumulate(leaf.rows);
  leaf.value = Eigen::VectorXd::Zero(data_.outputs.cols());
  leaf.slope = Eigen::MatrixXd::Zero(data_.outputs.cols(), std::ssize(data_.training.regressors));
  return leaf;
}

/// The local model as a correction of the parent's, of minimum norm in regressors of unit variance in the node.
void BinnedLeaves::fit(BinnedLeaf& leaf, const std::vector<double>& gram, const Node& parent, Node& node) const {
  const GramShape& shape = rows_.shape();
  const Eigen::MatrixXd& colouring = rows_.colouring();
  const std::ptrdiff_t regressors = std::ssize(data_.training.regressors);
  const auto entry = [&](std::ptrdiff_t i, std::ptrdiff_t j) {
    return gram[static_cast<std::size_t>(i >= j ? shape.at(i, j) : shape.at(j, i))];
  };
  const double weight = entry(0, 0);
  leaf.weight = weight;
  Eigen::VectorXd mean(regressors);
  Eigen::MatrixXd covariance(regressors, regressors);
  for (std::ptrdiff_t i = 0; i < regressors; ++i) {
    mean(i) = entry(i + 1, 0) / weight;
  }
  for (std::ptrdiff_t i = 0; i < regressors; ++i) {
    for (std::ptrdiff_t j = 0; j < regressors; ++j) {
      covariance(i, j) = entry(i + 1, j + 1) / weight - mean(i) * mean(j);
    }
  }
  leaf.mean = colouring * mean;
  leaf.covariance = colouring * covariance * colouring.transpose();
  Eigen::VectorXd deviation(regressors);  // 0: constant in the node
  for (std::ptrdiff_t k = 0; k < regressors; ++k) {
    const double variance = leaf.covariance(k, k);
    deviation(k) = variance > 1e-12 * (1.0 + leaf.mean(k) * leaf.mean(k)) ? std::sqrt(variance) : 0.0;
  }
  const Eigen::VectorXd per_deviation =
      deviation.unaryExpr([](double value) { return value > 0.0 ? 1.0 / value : 0.0; });
  const Whitening whitening = whiten(per_deviation.asDiagonal() * leaf.covariance * per_deviation.asDiagonal());
  const Eigen::MatrixXd inverse = whitening.forward * whitening.forward.transpose();
  const std::ptrdiff_t outputs = data_.outputs.cols();
  node.samples = std::ssize(leaf.rows);
  node.rank = 1 + static_cast<int>(whitening.rank);
  node.mean = data_.training.scale.cwiseProduct(leaf.mean);
  node.low = node.high = node.mean;
  node.rss.resize(outputs);
  node.value.resize(outputs);
  node.slope.resize(outputs, regressors);
  for (std::ptrdiff_t o = 0; o < outputs; ++o) {
    const std::ptrdiff_t residual = shape.coefficients() + o;
    Eigen::VectorXd product(regressors);
    const double mean_residual = entry(residual, 0) / weight;
    for (std::ptrdiff_t k = 0; k < regressors; ++k) {
      product(k) = entry(residual, k + 1) / weight - mean_residual * mean(k);
    }
    // The parent's model about the one whose residuals the features hold, then the correction of it.
    const Eigen::VectorXd of_parent =
        data_.training.scale.cwiseProduct((parent.slope.row(o) - leaf.slope.row(o)).transpose());
    const Eigen::VectorXd left = colouring * product - leaf.covariance * of_parent;
    const Eigen::VectorXd correction = per_deviation.cwiseProduct(inverse * per_deviation.cwiseProduct(left));
    const Eigen::VectorXd slope = of_parent + correction;
    const double variance = entry(residual, residual) / weight - mean_residual * mean_residual;
    const double explained = 2.0 * slope.dot(colouring * product) - slope.dot(leaf.covariance * slope);
    node.rss(o) = std::max(0.0, weight * (variance - explained));
    node.slope.row(o) = leaf.slope.row(o) + slope.cwiseQuotient(data_.training.scale).transpose();
    node.value(o) = leaf.value(o) + mean_residual - slope.dot(leaf.mean);
  }
}

SplitCandidate BinnedLeaves::examine(BinnedLeaf& leaf, const Node& parent, Node& node, double& excess) {
  if (!leaf.histogram) {
    leaf.histogram = rows_.accumulate(leaf.rows);
  }
  const GramShape& shape = rows_.shape();
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<double> gram = rows_.total(*leaf.histogram);
    fit(leaf, gram, parent, node);
    double held = 0.0;
    for (std::ptrdiff_t o = 0; o < data_.outputs.cols(); ++o) {
      const std::ptrdiff_t residual = shape.coefficients() + o;
      held += data_.output_weights(o) * gram[static_cast<std::size_t>(shape.at(residual, residual))];
    }
    if (pass == 1 || data_.output_weights.dot(node.rss) >= digits_at_risk * held) {
      break;
    }
    rows_.subtract(leaf.rows, node.value - leaf.value, (node.slope - leaf.slope) * data_.training.scale.asDiagonal());
    leaf.value = node.value;
    leaf.slope = node.slope;
    leaf.histogram = rows_.accumulate(leaf.rows);
  }
  return rows_.search(*leaf.histogram, leaf.rows, data_.output_weights.dot(node.rss), node.rank, excess);
}

void BinnedLeaves::wait(BinnedLeaf& leaf) {
  if (!leaf.histogram) {
    return;
  }
  const std::ptrdiff_t size = std::ssize(leaf.histogram->grams);
  if (size <= memory_left_) {
    memory_left_ -= size;
  } else {
    leaf.histogram.reset();
  }
}

std::array<BinnedLeaf, 2> BinnedLeaves::divide(BinnedLeaf& leaf, const SplitCandidate& split) {
  std::array<BinnedLeaf, 2> children;
  children[0].rows.resize(static_cast<std::size_t>(split.left));
  children[1].rows.resize(leaf.rows.size() - static_cast<std::size_t>(split.left));
  std::array<int*, 2> next = {children[1].rows.data(), children[0].rows.data()};
  for (const int row : leaf.rows) {
    *next[rows_.goes_left(row, split) ? 1 : 0]++ = row;
  }
  for (BinnedLeaf& child : children) {
    child.value = leaf.value;
    child.slope = leaf.slope;
  }
  if (leaf.histogram) {
    memory_left_ += std::ssize(leaf.histogram->grams);
    const std::size_t small = children[0].rows.size() <= children[1].rows.size() ? 0 : 1;
    children[small].histogram = rows_.accumulate(children[small].rows);
    const Histogram& less = *children[small].histogram;
    for (std::size_t k = 0; k < less.grams.size(); ++k) {
      leaf.histogram->grams[k] -= less.grams[k];
    }
    for (std::size_t bin = 0; bin < less.counts.size(); ++bin) {
      leaf.histogram->counts[bin] -= less.counts[bin];
    }
    children[1 - small].histogram = std::move(leaf.histogram);
  }
  return children;
}

double BinnedLeaves::threshold(const BinnedLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                               const Node& right) const {
  const auto [low, high] = rows_.gap(leaf.rows, split);
  // The regression of the children's difference on the split input over the node's rows follows from the regressors'
  // covariance if the input is one of them.
  const TrainingRows& training = data_.training;
  const int column = data_.problem.options.split_inputs[static_cast<std::size_t>(split.input)];
  const auto regressor = std::find_if(training.regressors.begin(), training.regressors.end(),
                                      [&](const Regressor& each) { return each.input == column && each.level < 0; });
  const std::ptrdiff_t outputs = left.value.size();
  if (regressor == training.regressors.end()) {
    return data_.place_threshold(low, high, low, Eigen::VectorXd::Zero(outputs), Eigen::VectorXd::Zero(outputs));
  }
  const std::ptrdiff_t k = regressor - training.regressors.begin();
  const Eigen::MatrixXd slopes = (right.slope - left.slope) * training.scale.asDiagonal();
  const Eigen::VectorXd apart = right.value - left.value + slopes * leaf.mean;
  const double variance = leaf.covariance(k, k);
  const Eigen::VectorXd slope = variance > 0.0
                                    ? Eigen::VectorXd(slopes * leaf.covariance.col(k) / (variance * training.scale(k)))
                                    : Eigen::VectorXd::Zero(outputs);
  return data_.place_threshold(low, high, regressor->centre + node.mean(k), apart, slope);
}

}  // namespace llmt
