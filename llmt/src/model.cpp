#include "llmt/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "checks.hpp"
#include "parallel.hpp"

namespace llmt {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

[[noreturn]] void reject(const std::string& what) { throw std::invalid_argument("llmt::Model: " + what); }

void check_node(const Partition& partition, std::ptrdiff_t index, std::ptrdiff_t inputs, std::ptrdiff_t regressors,
                const std::string& where) {
  const Node& node = partition.nodes[static_cast<std::size_t>(index)];
  const std::ptrdiff_t outputs = std::ssize(partition.outputs);
  if (node.value.size() != outputs || node.rss.size() != outputs || node.slope.rows() != outputs ||
      node.slope.cols() != regressors) {
    reject(fmt::format("{}: value, rss and slope must have {} outputs and slope {} regression inputs", where, outputs,
                       regressors));
  }
  if (!node.value.allFinite() || !node.slope.allFinite() || !node.rss.allFinite() || !std::isfinite(node.threshold)) {
    reject(fmt::format("{}: a number is not finite", where));
  }
  if (node.samples < 0 || node.rank < 0 || (node.rss.array() < 0.0).any()) {
    reject(fmt::format("{}: samples, rank and rss cannot be negative", where));
  }
  if (node.is_leaf()) {
    if (node.right >= 0) {
      reject(fmt::format("{}: it has a right child and no left one", where));
    }
    return;
  }
  // The k-th split makes nodes 2k-1 and 2k, after their parent.
  if (node.left % 2 != 1 || node.right != node.left + 1 || node.left <= index ||
      node.right >= std::ssize(partition.nodes)) {
    reject(fmt::format("{}: the children {} and {} are not in order of growth", where, node.left, node.right));
  }
  if (node.split_input < 0 || node.split_input >= inputs) {
    reject(fmt::format("{}: split input {} does not exist, there are {} inputs", where, node.split_input, inputs));
  }
}

void check_partition(const Partition& partition, std::ptrdiff_t inputs, std::ptrdiff_t regressors,
                     const std::string& where) {
  if (partition.outputs.empty() || partition.nodes.empty() || partition.nodes.size() % 2 == 0) {
    reject(fmt::format("{}: it needs an output and an odd number of nodes", where));
  }
  std::vector<bool> has_parent(partition.nodes.size(), false);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    check_node(partition, static_cast<std::ptrdiff_t>(i), inputs, regressors, fmt::format("{} node {}", where, i));
    const Node& node = partition.nodes[i];
    if (!node.is_leaf()) {
      if (has_parent[static_cast<std::size_t>(node.left)]) {
        reject(fmt::format("{} node {}: it has two parents", where, node.left));
      }
      has_parent[static_cast<std::size_t>(node.left)] = true;
      has_parent[static_cast<std::size_t>(node.right)] = true;
    }
  }
  if (std::find(has_parent.begin() + 1, has_parent.end(), false) != has_parent.end()) {
    reject(fmt::format("{}: a node has no parent", where));
  }
}

/// Node of the leaf that holds row `row` of `inputs`.
std::size_t find_leaf(const Partition& partition, const Eigen::Ref<const Eigen::MatrixXd>& inputs, std::ptrdiff_t row) {
  std::size_t index = 0;
  while (!partition.nodes[index].is_leaf()) {
    const Node& node = partition.nodes[index];
    index = static_cast<std::size_t>(inputs(row, node.split_input) <= node.threshold ? node.left : node.right);
  }
  return index;
}

void check_query(const char* function, const Model& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  if (inputs.cols() != model.num_inputs()) {
    throw std::invalid_argument(
        fmt::format("{}: inputs has {} columns, the model has {} inputs", function, inputs.cols(), model.num_inputs()));
  }
  check_finite(function, "inputs", inputs);
}

/// Nodes of the leaves from left to right, with their boxes.
void collect_leaves(const Partition& partition, int index, Leaf box, const std::vector<InputColumn>& inputs,
                    const std::vector<int>& regression_inputs, std::vector<Leaf>& leaves) {
  const Node& node = partition.nodes[static_cast<std::size_t>(index)];
  if (!node.is_leaf()) {
    Leaf right = box;
    box.high(node.split_input) = std::min(box.high(node.split_input), node.threshold);
    right.low(node.split_input) = std::max(right.low(node.split_input), node.threshold);
    collect_leaves(partition, node.left, std::move(box), inputs, regression_inputs, leaves);
    collect_leaves(partition, node.right, std::move(right), inputs, regression_inputs, leaves);
    return;
  }
  box.node = index;
  box.samples = node.samples;
  box.rank = node.rank;
  box.rmse = (node.rss / static_cast<double>(std::max<std::ptrdiff_t>(node.samples, 1))).cwiseSqrt();
  box.slope = node.slope;
  box.intercept = node.value;
  for (std::size_t j = 0; j < regression_inputs.size(); ++j) {
    box.intercept -=
        node.slope.col(static_cast<std::ptrdiff_t>(j)) * inputs[static_cast<std::size_t>(regression_inputs[j])].centre;
  }
  leaves.push_back(std::move(box));
}

}  // namespace

Model::Model(std::vector<InputColumn> inputs, std::vector<OutputColumn> outputs, std::vector<int> regression_inputs,
             std::vector<Partition> partitions)
    : inputs_(std::move(inputs)),
      outputs_(std::move(outputs)),
      regression_inputs_(std::move(regression_inputs)),
      partitions_(std::move(partitions)) {
  if (inputs_.empty() || outputs_.empty()) {
    reject(fmt::format("it has {} inputs and {} outputs, both must be at least 1", inputs_.size(), outputs_.size()));
  }
  for (const InputColumn& input : inputs_) {
    if (!(std::isfinite(input.low) && std::isfinite(input.centre) && std::isfinite(input.high) &&
          input.low <= input.high)) {
      reject(fmt::format("input \"{}\": low {}, centre {} and high {} must be finite and low <= high", input.name,
                         input.low, input.centre, input.high));
    }
  }
  for (const OutputColumn& output : outputs_) {
    if (!(std::isfinite(output.low) && std::isfinite(output.high) && output.low <= output.high)) {
      reject(fmt::format("output \"{}\": low {} and high {} must be finite and low <= high", output.name, output.low,
                         output.high));
    }
  }
  check_columns("llmt::Model", "regression_inputs", regression_inputs_, num_inputs());
  std::vector<int> served;
  for (std::size_t i = 0; i < partitions_.size(); ++i) {
    check_partition(partitions_[i], num_inputs(), std::ssize(regression_inputs_), fmt::format("partition {}", i));
    served.insert(served.end(), partitions_[i].outputs.begin(), partitions_[i].outputs.end());
  }
  check_columns("llmt::Model", "outputs of the partitions", served, num_outputs());
  if (std::ssize(served) != num_outputs()) {
    reject(fmt::format("{} of {} outputs have a partition", served.size(), num_outputs()));
  }
}

Eigen::MatrixXd Model::predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads) const {
  check_query("llmt::Model::predict", *this, inputs);
  Eigen::MatrixXd predicted(inputs.rows(), num_outputs());
  const std::ptrdiff_t regressors = std::ssize(regression_inputs_);
  constexpr std::ptrdiff_t block = 4096;
  parallel_for((inputs.rows() + block - 1) / block, max_threads, [&](std::ptrdiff_t block_index) {
    Eigen::VectorXd deviation(regressors);
    const std::ptrdiff_t end = std::min(inputs.rows(), (block_index + 1) * block);
    for (std::ptrdiff_t row = block_index * block; row < end; ++row) {
      for (std::ptrdiff_t j = 0; j < regressors; ++j) {
        const int column = regression_inputs_[static_cast<std::size_t>(j)];
        deviation(j) = inputs(row, column) - inputs_[static_cast<std::size_t>(column)].centre;
      }
      for (const Partition& partition : partitions_) {
        const Node& leaf = partition.nodes[find_leaf(partition, inputs, row)];
        for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
          double value = leaf.value(static_cast<std::ptrdiff_t>(o));
          for (std::ptrdiff_t j = 0; j < regressors; ++j) {
            value += leaf.slope(static_cast<std::ptrdiff_t>(o), j) * deviation(j);
          }
          predicted(row, partition.outputs[o]) = value;
        }
      }
    }
  });
  return predicted;
}

Eigen::MatrixXi Model::leaf_of(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const {
  check_query("llmt::Model::leaf_of", *this, inputs);
  Eigen::MatrixXi result(inputs.rows(), std::ssize(partitions_));
  for (std::ptrdiff_t p = 0; p < result.cols(); ++p) {
    const Partition& partition = partitions_[static_cast<std::size_t>(p)];
    std::vector<int> position_of_node(partition.nodes.size(), -1);
    const std::vector<Leaf> table = leaves(p);
    for (std::size_t position = 0; position < table.size(); ++position) {
      position_of_node[static_cast<std::size_t>(table[position].node)] = static_cast<int>(position);
    }
    for (std::ptrdiff_t row = 0; row < inputs.rows(); ++row) {
      result(row, p) = position_of_node[find_leaf(partition, inputs, row)];
    }
  }
  return result;
}

Eigen::VectorXd Model::outside(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const {
  check_query("llmt::Model::outside", *this, inputs);
  Eigen::VectorXd distance = Eigen::VectorXd::Zero(inputs.rows());
  for (std::ptrdiff_t j = 0; j < num_inputs(); ++j) {
    const InputColumn& input = inputs_[static_cast<std::size_t>(j)];
    const double range = input.high - input.low;
    for (std::ptrdiff_t row = 0; row < inputs.rows(); ++row) {
      const double excess = std::max(input.low - inputs(row, j), inputs(row, j) - input.high);
      if (excess > 0.0) {
        distance(row) = std::max(distance(row), range > 0.0 ? excess / range : infinity);
      }
    }
  }
  return distance;
}

std::vector<Leaf> Model::leaves(std::ptrdiff_t partition) const {
  if (partition < 0 || partition >= std::ssize(partitions_)) {
    throw std::invalid_argument(
        fmt::format("llmt::Model::leaves: partition is {}, the model has {}", partition, partitions_.size()));
  }
  Leaf everywhere;
  everywhere.low = Eigen::VectorXd::Constant(num_inputs(), -infinity);
  everywhere.high = Eigen::VectorXd::Constant(num_inputs(), infinity);
  std::vector<Leaf> result;
  collect_leaves(partitions_[static_cast<std::size_t>(partition)], 0, everywhere, inputs_, regression_inputs_, result);
  return result;
}

Partition prefix(const Partition& partition, std::ptrdiff_t max_leaves) {
  if (max_leaves < 1) {
    throw std::invalid_argument(fmt::format("llmt::prefix: max_leaves is {}, it must be at least 1", max_leaves));
  }
  const std::ptrdiff_t kept = 2 * std::min(max_leaves, partition.num_leaves()) - 1;
  Partition result{.outputs = partition.outputs, .nodes = {partition.nodes.begin(), partition.nodes.begin() + kept}};
  for (Node& node : result.nodes) {
    if (node.left >= kept) {
      node.left = node.right = node.split_input = -1;
      node.threshold = 0.0;
    }
  }
  return result;
}

Model Model::prefix(std::ptrdiff_t max_leaves) const {
  Model result = *this;
  for (Partition& partition : result.partitions_) {
    partition = llmt::prefix(partition, max_leaves);
  }
  return result;
}

Model Model::named(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs) const {
  if (std::ssize(inputs) != num_inputs() || std::ssize(outputs) != num_outputs()) {
    throw std::invalid_argument(
        fmt::format("llmt::Model::named: {} input and {} output names for {} inputs and {} outputs", inputs.size(),
                    outputs.size(), num_inputs(), num_outputs()));
  }
  Model result = *this;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    result.inputs_[i].name = inputs[i];
  }
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    result.outputs_[o].name = outputs[o];
  }
  return result;
}

}  // namespace llmt
