#include "growth/best_first/whitened_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/parallel.hpp"

namespace llmt {
namespace {

// A node whose RSS is below this part of the sum of squares that its features hold gets features of its own residuals.
constexpr double digits_at_risk = 1e-4;

// Mean and covariance of the regressors of the features, from the Gram matrix of a node's rows.
struct Moments {
  double weight;
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

Moments moments_of(const GramShape& shape, const std::vector<double>& gram) {
  const Eigen::Index regressors = shape.coefficients() - 1;
  const auto entry = [&](Eigen::Index i, Eigen::Index j) { return gram[i >= j ? shape.at(i, j) : shape.at(j, i)]; };
  Moments moments{entry(0, 0), Eigen::VectorXd(regressors), Eigen::MatrixXd(regressors, regressors)};
  for (Eigen::Index i = 0; i < regressors; ++i) {
    moments.mean(i) = entry(i + 1, 0) / moments.weight;
  }
  for (Eigen::Index i = 0; i < regressors; ++i) {
    for (Eigen::Index j = 0; j < regressors; ++j) {
      moments.covariance(i, j) = entry(i + 1, j + 1) / moments.weight - moments.mean(i) * moments.mean(j);
    }
  }
  return moments;
}

// 1 / standard deviation of each scaled regressor in the node; 0 where it is constant but for rounding.
Eigen::VectorXd inverse_deviations(const WhitenedLeaf& leaf) {
  constexpr double rounding = 1e-12;  // of a mean square
  Eigen::VectorXd result(leaf.mean.size());
  for (Eigen::Index k = 0; k < result.size(); ++k) {
    const double variance = leaf.covariance(k, k);
    const bool varies = variance > rounding * (1.0 + leaf.mean(k) * leaf.mean(k));
    result(k) = varies ? 1.0 / std::sqrt(variance) : 0.0;
  }
  return result;
}

}  // namespace

// Regressors are whitened over all rows; residuals are those of the mean.
WhitenedRows::WhitenedRows(const GrowthData& data)
    : features_(data.training.count(), std::ssize(data.training.regressors) + 1, data.outputs.cols()) {
  const GramShape shape(features_);
  const TrainingRows& training = data.training;
  const Eigen::Index regressors = std::ssize(training.regressors);
  const int threads = data.problem.max_threads;
  const Eigen::RowVectorXd per_scale = training.scale.cwiseInverse().transpose();
  const RowBlocks blocks{training.count()};
  const auto add_block = [&](RowSpan block, std::vector<double>& gram) {
    const Chunk chunk = fetch(training, block.begin / block_rows, {});
    std::vector<int> rows(block.count());
    std::iota(rows.begin(), rows.end(), static_cast<int>(block.begin));
    for (Eigen::Index i = 0; i < chunk.count(); ++i) {
      const Eigen::Index at = block.begin + i;
      const double root = std::sqrt(chunk.weights(i));
      double* row = features_.row(at);
      row[0] = root;
      Eigen::Map<Eigen::RowVectorXd>(row + 1, regressors) = root * chunk.deviations.row(i).cwiseProduct(per_scale);
      Eigen::Map<Eigen::RowVectorXd>(row + 1 + regressors, data.outputs.cols()) = root * data.outputs.row(at);
    }
    add_rows(features_, rows.data(), block.count(), gram.data());
  };
  const std::vector<double> gram = sum_over(blocks, threads, std::vector<double>(shape.size(), 0.0), add_block);
  Eigen::MatrixXd covariance(regressors, regressors);
  for (Eigen::Index i = 0; i < regressors; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      covariance(i, j) = covariance(j, i) = gram[shape.at(i + 1, j + 1)] / gram[0];
    }
  }
  const Whitening whitening = whiten(covariance);
  const Eigen::MatrixXd& forward = whitening.forward;
  colouring_ = whitening.back;
  parallel_for(blocks.count(), threads, [&](Eigen::Index index) {
    const RowSpan block = blocks[index];
    using Stride = Eigen::OuterStride<>;
    Eigen::Map<RowMajor, 0, Stride> rows(features_.row(block.begin) + 1, block.count(), regressors,
                                         Stride(features_.columns()));
    const RowMajor whitened = rows * forward;
    rows = whitened;
  });
}

void WhitenedRows::subtract(const std::vector<int>& rows, const Eigen::VectorXd& value, const Eigen::MatrixXd& slope) {
  const Eigen::Index regressors = slope.cols();
  // slope . x = (colouring' slope) . regressors
  const Eigen::MatrixXd of_features = slope * colouring_;
  for (const int row : rows) {
    double* const at = features_.row(row);
    const Eigen::Map<const Eigen::VectorXd> x(at + 1, regressors);
    for (Eigen::Index o = 0; o < value.size(); ++o) {
      at[1 + regressors + o] -= value(o) * at[0] + of_features.row(o).dot(x);
    }
  }
}

bool is_complete(const GrowthData& data) {
  const std::vector<int>& inputs = data.problem.options.split_inputs;
  const auto complete = [&](int input) { return !data.training.table->inputs.col(input).hasNaN(); };
  return !data.training.has_missing && std::ranges::all_of(inputs, complete);
}

WhitenedLeaf whitened_root(const GrowthData& data) {
  WhitenedLeaf leaf;
  leaf.rows.resize(data.training.count());
  std::iota(leaf.rows.begin(), leaf.rows.end(), 0);
  leaf.value = Eigen::VectorXd::Zero(data.outputs.cols());
  leaf.slope = Eigen::MatrixXd::Zero(data.outputs.cols(), std::ssize(data.training.regressors));
  return leaf;
}

void fit_whitened(const GrowthData& data, const WhitenedRows& rows, const std::vector<double>& gram, const Node& parent,
                  WhitenedLeaf& leaf, Node& node) {
  const GramShape shape(rows.features());
  const Eigen::MatrixXd& colouring = rows.colouring();
  const Eigen::Index regressors = std::ssize(data.training.regressors);
  const Eigen::Index outputs = data.outputs.cols();
  const auto [weight, mean, covariance] = moments_of(shape, gram);
  leaf.weight = weight;
  leaf.mean = colouring * mean;
  leaf.covariance = colouring * covariance * colouring.transpose();
  const Eigen::VectorXd per_deviation = inverse_deviations(leaf);
  const Whitening whitening = whiten(per_deviation.asDiagonal() * leaf.covariance * per_deviation.asDiagonal());
  const Eigen::MatrixXd inverse = whitening.forward * whitening.forward.transpose();
  node.samples = std::ssize(leaf.rows);
  node.rank = 1 + static_cast<int>(whitening.rank);
  node.mean = data.training.scale.cwiseProduct(leaf.mean);
  node.low = node.high = node.mean;
  node.rss.resize(outputs);
  node.value.resize(outputs);
  node.slope.resize(outputs, regressors);
  for (Eigen::Index o = 0; o < outputs; ++o) {
    const Eigen::Index residual = shape.coefficients() + o;
    Eigen::VectorXd product(regressors);
    const double mean_residual = gram[shape.at(residual, 0)] / weight;
    for (Eigen::Index k = 0; k < regressors; ++k) {
      product(k) = gram[shape.at(residual, k + 1)] / weight - mean_residual * mean(k);
    }
    // The parent's model about the model whose residuals the features hold, then the correction of it.
    const Eigen::VectorXd of_parent =
        data.training.scale.cwiseProduct((parent.slope.row(o) - leaf.slope.row(o)).transpose());
    const Eigen::VectorXd left = colouring * product - leaf.covariance * of_parent;
    const Eigen::VectorXd correction = per_deviation.cwiseProduct(inverse * per_deviation.cwiseProduct(left));
    const Eigen::VectorXd slope = of_parent + correction;
    const double variance = gram[shape.at(residual, residual)] / weight - mean_residual * mean_residual;
    const double explained = 2.0 * slope.dot(colouring * product) - slope.dot(leaf.covariance * slope);
    node.rss(o) = std::max(0.0, weight * (variance - explained));
    node.slope.row(o) = leaf.slope.row(o) + slope.cwiseQuotient(data.training.scale).transpose();
    node.value(o) = leaf.value(o) + mean_residual - slope.dot(leaf.mean);
  }
}

bool refreshed(const GrowthData& data, WhitenedRows& rows, const std::vector<double>& gram, const Node& node,
               WhitenedLeaf& leaf) {
  const GramShape shape(rows.features());
  double held = 0.0;
  for (Eigen::Index o = 0; o < data.outputs.cols(); ++o) {
    const Eigen::Index residual = shape.coefficients() + o;
    held += data.output_weights(o) * gram[shape.at(residual, residual)];
  }
  if (data.output_weights.dot(node.rss) >= digits_at_risk * held) return false;
  rows.subtract(leaf.rows, node.value - leaf.value, (node.slope - leaf.slope) * data.training.scale.asDiagonal());
  leaf.value = node.value;
  leaf.slope = node.slope;
  return true;
}

double place_threshold(const GrowthData& data, const WhitenedLeaf& leaf, Eigen::Index split_input, double low,
                       double high, const Node& node, const Node& left, const Node& right) {
  // The regression of the children's difference on the split input over the node's rows follows from the regressors'
  // covariance if the input is one of them.
  const TrainingRows& training = data.training;
  const int column = data.problem.options.split_inputs[split_input];
  const auto regressor = std::ranges::find_if(
      training.regressors, [&](const Regressor& each) { return each.input == column && each.level < 0; });
  const Eigen::Index outputs = left.value.size();
  if (regressor == training.regressors.end()) {
    return data.place_threshold(low, high, low, Eigen::VectorXd::Zero(outputs), Eigen::VectorXd::Zero(outputs));
  }
  const Eigen::Index k = regressor - training.regressors.begin();
  const Eigen::MatrixXd slopes = (right.slope - left.slope) * training.scale.asDiagonal();
  const Eigen::VectorXd apart = right.value - left.value + slopes * leaf.mean;
  const double variance = leaf.covariance(k, k);
  const Eigen::VectorXd slope = variance > 0.0
                                    ? Eigen::VectorXd(slopes * leaf.covariance.col(k) / (variance * training.scale(k)))
                                    : Eigen::VectorXd::Zero(outputs);
  return data.place_threshold(low, high, regressor->centre + node.mean(k), apart, slope);
}

}  // namespace llmt
