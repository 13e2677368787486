#include "stream/crisp_partition.hpp"

#include <algorithm>
#include <queue>

#include "base/count.hpp"
#include "estimation/estimate.hpp"
#include "estimation/leaf_statistics.hpp"

namespace llmt {
namespace {

// The inverse Gram matrix of [1, deviations] of the model, from the sums of [1, z - origin].
Eigen::MatrixXd inverse_gram_of(const StreamSetting& setting, const Basis& basis, const Sums& sums,
                                const std::vector<ColumnRange>& columns) {
  const Eigen::Index size = setting.coefficients();
  Eigen::MatrixXd transform = Eigen::MatrixXd::Identity(size, size);
  for (Eigen::Index k = 0; k < setting.inputs; ++k) {
    transform(k + 1, 0) = setting.unscaled(k, basis.origin(k)) - columns[k].mean;
    transform(k + 1, k + 1) = setting.scale(k);
  }
  const Eigen::MatrixXd gram = matrix_of(setting.shape, sums.gram.data()).topLeftCorner(size, size);
  return inverse_gram(transform * gram * transform.transpose(), transform.diagonal());
}

// A node of the stream as a leaf of a partition.
Node leaf_of(const StreamSetting& setting, const StreamNode& node, const std::vector<ColumnRange>& columns) {
  const Eigen::Index inputs = setting.inputs;
  const Sums sums = all_sums(setting, node);
  int rank = 0;
  const Eigen::VectorXd change = solve(setting.shape, sums.gram.data(), setting.shrinkage, rank);
  const bool few = node.is_leaf() && sums.rows < few_rows_per_coefficient * setting.coefficients();
  const Eigen::VectorXd model = few ? node.model : node.basis.base + change;
  Node result;
  result.samples = sums.rows;
  result.rank = std::max(1, rank);
  result.rss = Eigen::VectorXd::Constant(1, remaining(setting.shape, sums.gram.data(), model - node.basis.base));
  result.slope.resize(1, inputs);
  result.mean.resize(inputs);
  result.low.resize(inputs);
  result.high.resize(inputs);
  result.value = Eigen::VectorXd::Constant(1, model(0));
  for (Eigen::Index k = 0; k < inputs; ++k) {
    const ColumnRange& column = columns[k];
    const double origin = setting.unscaled(k, node.basis.origin(k));
    result.slope(0, k) = model(k + 1) / setting.scale(k);
    result.value(0) += result.slope(0, k) * (column.mean - origin);
    const bool has_values = node.low(k) <= node.high(k);
    result.low(k) = (has_values ? node.low(k) : origin) - column.mean;
    result.high(k) = (has_values ? node.high(k) : origin) - column.mean;
    // A missing value counts as the origin.
    result.mean(k) = std::clamp(origin - column.mean, result.low(k), result.high(k));
  }
  result.inverse_gram = inverse_gram_of(setting, node.basis, sums, columns);
  return result;
}

// A split that has not been entered yet. The largest gain comes first, of equal gains the older node.
struct Waiting {
  double gain;
  std::size_t position;
  const StreamNode* node;
  bool operator<(const Waiting& other) const {
    return gain != other.gain ? gain < other.gain : position > other.position;
  }
};

}  // namespace

Partition crisp_partition(const StreamSetting& setting, const StreamNode& root, const std::vector<ColumnRange>& columns,
                          int output) {
  Partition partition{.outputs = {output}, .validity = {}, .nodes = {}, .outer_slope = {}, .residual_range = {}};
  std::priority_queue<Waiting> queue;
  const auto enter = [&](const StreamNode& node) {
    if (!node.is_leaf()) {
      queue.push({node.gain * static_cast<double>(node.rows()), partition.nodes.size(), &node});
    }
    partition.nodes.push_back(leaf_of(setting, node, columns));
  };
  enter(root);
  while (!queue.empty()) {
    const Waiting next = queue.top();
    queue.pop();
    const StreamNode& from = *next.node;
    const int left = count_of(partition.nodes);
    Node& node = partition.nodes[next.position];
    node.left = left;
    node.right = left + 1;
    node.split_input = from.input;
    node.threshold = from.threshold;
    const double rows_left = static_cast<double>(from.children[0]->rows());
    const double rows_right = static_cast<double>(from.children[1]->rows());
    node.missing_left = rows_left >= rows_right ? 1.0 : 0.0;
    enter(*from.children[0]);
    enter(*from.children[1]);
  }
  partition.outer_slope = agreed_slope(partition);
  return partition;
}

}  // namespace llmt
