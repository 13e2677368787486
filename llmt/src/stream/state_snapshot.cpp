// The model of a stream as it stands.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <queue>
#include <utility>

#include "base/count.hpp"
#include "base/matrix.hpp"
#include "data/dataset.hpp"
#include "estimation/leaf_statistics.hpp"
#include "fit/pipeline.hpp"
#include "partition/tree.hpp"
#include "stream/snapshot.hpp"
#include "stream/state.hpp"

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

// The tree below a node as a crisp partition, in the units of inputs and output. Splits are in the order of what they
// gained. `columns`: of the inputs.
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
  partition.outer_slope = agreed_slope(partition, partition.num_leaves());
  return partition;
}

}  // namespace

Model StreamState::snapshot(ValidityChoice validity) const {
  if (trees_.empty()) return model_of_first_rows();
  std::vector<InputColumn> inputs;
  std::vector<OutputColumn> outputs;
  std::vector<Regressor> regressors;
  for (int j = 0; j < inputs_; ++j) {
    const ColumnRange& column = columns_[j];
    inputs.push_back(
        {.name = fmt::format("x{}", j + 1), .low = column.low, .high = column.high, .centre = column.mean});
    regressors.push_back({j, -1, column.mean});
  }
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    const ColumnRange& column = columns_[inputs_ + o];
    outputs.push_back({outputs_ == 1 ? "y" : fmt::format("y{}", o + 1), column.low, column.high});
  }
  std::vector<Partition> partitions = crisp_partitions();
  choose_by_reservoir(inputs, regressors, validity, partitions);
  for (Partition& partition : partitions) {
    for (Node& node : partition.nodes) {
      if (!node.is_leaf()) node.inverse_gram.resize(0, 0);
    }
  }
  return Model(std::move(inputs), std::move(outputs), std::move(regressors), std::move(partitions));
}

// One linear model of the rows before the trees start.
Model StreamState::model_of_first_rows() const {
  const Eigen::Map<const RowMajor> first(first_rows_.data(), std::ssize(first_rows_) / width(), width());
  FitOptions one_leaf;
  one_leaf.max_leaves = 1;
  one_leaf.folds.count = 0;
  const Eigen::MatrixXd inputs = first.leftCols(inputs_);
  const Eigen::MatrixXd outputs = first.middleCols(inputs_, outputs_);
  // Not fit(), which refuses an output that hides the others: the trees of a stream take it too.
  Work uncounted;
  const GivenRows rows{.inputs = {inputs}, .outputs = {outputs}, .weights = first.rightCols(1)};
  return fit(prepare_plain(checked(rows, one_leaf), one_leaf, uncounted), uncounted).model;
}

std::vector<Partition> StreamState::crisp_partitions() const {
  const std::vector<ColumnRange> of_inputs(columns_.begin(), columns_.begin() + inputs_);
  std::vector<Partition> partitions;
  for (int o = 0; o < outputs_; ++o) {
    const StreamTree& tree = *trees_[o];
    partitions.push_back(crisp_partition(tree.setting(), tree.root(), of_inputs, o));
  }
  return partitions;
}

// Replaces each partition by the one that choose() takes on the rows of the reservoir.
void StreamState::choose_by_reservoir(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors,
                                      ValidityChoice validity, std::vector<Partition>& partitions) const {
  Eigen::MatrixXd values(std::ssize(reservoir_.rows()), width());
  std::vector<int> others;
  std::vector<int> held_out;
  int at = 0;
  for (const auto& [hash, row] : reservoir_.rows()) {
    (row.held_out ? held_out : others).push_back(at);
    values.row(at++) = Eigen::Map<const Eigen::RowVectorXd>(row.values.data(), values.cols());
  }
  if (others.empty()) return;
  std::vector<int> all_inputs(inputs_);
  std::iota(all_inputs.begin(), all_inputs.end(), 0);
  const Table table{values.leftCols(inputs_),
                    values.middleCols(inputs_, outputs_),
                    values.rightCols(1),
                    std::vector<int>(inputs_, 0),
                    all_inputs,
                    all_inputs};
  TrainingRows training = training_rows(table, std::move(others));
  training.columns = inputs;
  training.regressors = regressors;
  const TrainingRows queries = query_rows(table, std::move(held_out), training);
  for (Partition& partition : partitions) {
    partition = choose(training, queries, std::move(partition), validity);
  }
}

}  // namespace llmt
