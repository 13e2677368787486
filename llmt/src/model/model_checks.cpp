#include "model/model_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/checks.hpp"

namespace llmt {
namespace {

[[noreturn]] void reject(const std::string& what) { throw std::invalid_argument("llmt::Model: " + what); }

void check_direction(const Node& node, const std::vector<InputColumn>& inputs, const std::string& where) {
  if (!node.is_oblique()) return;
  if (node.direction.size() != std::ssize(inputs) || !node.direction.allFinite()) {
    reject(fmt::format("{}: direction has {} entries, it must have {} finite ones", where, node.direction.size(),
                       inputs.size()));
  }
  // So it is not zero either, and its split input is a number.
  if (node.direction(node.split_input) == 0.0) {
    reject(fmt::format("{}: direction has weight 0 for the split input {}", where, node.split_input));
  }
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    if (inputs[j].is_categorical() && node.direction(j) != 0.0) {
      reject(fmt::format("{}: direction has weight {} for the categorical input \"{}\", it must be 0", where,
                         node.direction(j), inputs[j].name));
    }
  }
}

// Sizes of the local model and of what is known of its rows.
void check_shapes(const Node& node, Eigen::Index outputs, Eigen::Index regressors, const std::string& where) {
  if (node.value.size() != outputs || node.rss.size() != outputs || node.slope.rows() != outputs ||
      node.slope.cols() != regressors) {
    reject(fmt::format("{}: value, rss and slope must have {} outputs and slope {} regression inputs", where, outputs,
                       regressors));
  }
  if (node.mean.size() != regressors || node.low.size() != regressors || node.high.size() != regressors) {
    reject(fmt::format("{}: mean, low and high must have {} regressors", where, regressors));
  }
}

void check_values(const Node& node, Eigen::Index regressors, const std::string& where) {
  if (!(node.low.array() <= node.high.array()).all() || !node.mean.allFinite() || !node.low.allFinite() ||
      !node.high.allFinite()) {
    reject(fmt::format("{}: mean, low and high must be finite and low <= high", where));
  }
  if (!(node.half_width >= 0.0 && std::isfinite(node.half_width))) {
    reject(fmt::format("{}: half_width {} must be finite and not negative", where, node.half_width));
  }
  if (!(node.missing_left >= 0.0 && node.missing_left <= 1.0)) {
    reject(fmt::format("{}: missing_left {} must lie between 0 and 1", where, node.missing_left));
  }
  if (node.inverse_gram.size() > 0 && (node.inverse_gram.rows() != regressors + 1 ||
                                       node.inverse_gram.cols() != regressors + 1 || !node.inverse_gram.allFinite())) {
    reject(fmt::format("{}: inverse_gram must be finite, {} x {}", where, regressors + 1, regressors + 1));
  }
  if (!node.value.allFinite() || !node.slope.allFinite() || !node.rss.allFinite() || !std::isfinite(node.threshold)) {
    reject(fmt::format("{}: a number is not finite", where));
  }
  if (node.samples < 0 || node.rank < 0 || (node.rss.array() < 0.0).any()) {
    reject(fmt::format("{}: samples, rank and rss cannot be negative", where));
  }
}

void check_split(const Node& node, const std::vector<InputColumn>& inputs, const std::string& where) {
  if (node.split_input < 0 || node.split_input >= std::ssize(inputs)) {
    reject(
        fmt::format("{}: split input {} does not exist, there are {} inputs", where, node.split_input, inputs.size()));
  }
  const InputColumn& input = inputs[node.split_input];
  if (node.level_side.size() != input.levels.size()) {
    reject(fmt::format("{}: {} sides for the {} levels of \"{}\"", where, node.level_side.size(), input.levels.size(),
                       input.name));
  }
  check_direction(node, inputs, where);
  if (std::ranges::any_of(node.level_side, [](int side) { return side < -1 || side > 1; })) {
    reject(fmt::format("{}: the side of a level must be -1, 0 or 1", where));
  }
}

void check_node(const Partition& partition, Eigen::Index index, const std::vector<InputColumn>& inputs,
                Eigen::Index regressors, const std::string& where) {
  const Node& node = partition.nodes[index];
  check_shapes(node, std::ssize(partition.outputs), regressors, where);
  check_values(node, regressors, where);
  if (node.guard_parent < -1 || node.guard_parent >= index || (node.guard_parent >= 0 && !node.is_leaf())) {
    reject(fmt::format("{}: guard_parent {} must be an earlier node, and only a leaf may have one", where,
                       node.guard_parent));
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
  check_split(node, inputs, where);
}

// Every node, and that each but the root has one parent.
void check_tree(const Partition& partition, const std::vector<InputColumn>& inputs, Eigen::Index regressors,
                const std::string& where) {
  std::vector<bool> has_parent(partition.nodes.size(), false);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    check_node(partition, i, inputs, regressors, fmt::format("{} node {}", where, i));
    const Node& node = partition.nodes[i];
    if (!node.is_leaf()) {
      if (has_parent[node.left]) {
        reject(fmt::format("{} node {}: it has two parents", where, node.left));
      }
      has_parent[node.left] = true;
      has_parent[node.right] = true;
    }
  }
  if (std::find(has_parent.begin() + 1, has_parent.end(), false) != has_parent.end()) {
    reject(fmt::format("{}: a node has no parent", where));
  }
}

void check_partition(const Partition& partition, const std::vector<InputColumn>& inputs, Eigen::Index regressors,
                     const std::string& where) {
  const Validity& validity = partition.validity;
  if (!(validity.width >= 0.0 && std::isfinite(validity.width)) ||
      (validity.smoothness != 1 && validity.smoothness != 2)) {
    reject(fmt::format("{}: the width {} must be finite and not negative, the smoothness {} 1 or 2", where,
                       validity.width, validity.smoothness));
  }
  if (partition.outputs.empty() || partition.nodes.empty() || partition.nodes.size() % 2 == 0) {
    reject(fmt::format("{}: it needs an output and an odd number of nodes", where));
  }
  if (validity.kind == ValidityKind::gaussian &&
      std::ranges::any_of(partition.nodes, [](const Node& node) { return node.is_oblique(); })) {
    reject(fmt::format("{}: Gaussians need boxes, and a node has a direction", where));
  }
  if (partition.outer_slope.size() > 0 &&
      (partition.outer_slope.rows() != std::ssize(partition.outputs) || partition.outer_slope.cols() != regressors ||
       !partition.outer_slope.allFinite())) {
    reject(fmt::format("{}: outer_slope must be finite, {} x {}", where, partition.outputs.size(), regressors));
  }
  if (partition.residual_range.size() > 0 &&
      (partition.residual_range.rows() != std::ssize(partition.outputs) || partition.residual_range.cols() != 2 ||
       !partition.residual_range.allFinite() ||
       (partition.residual_range.col(0).array() > partition.residual_range.col(1).array()).any())) {
    reject(fmt::format("{}: residual_range must be finite, {} x 2, low <= high", where, partition.outputs.size()));
  }
  check_tree(partition, inputs, regressors, where);
}

void check_columns_of_model(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs) {
  if (inputs.empty() || outputs.empty()) {
    reject(fmt::format("it has {} inputs and {} outputs, both must be at least 1", inputs.size(), outputs.size()));
  }
  for (const InputColumn& input : inputs) {
    if (!(std::isfinite(input.low) && std::isfinite(input.centre) && std::isfinite(input.high) &&
          input.low <= input.high)) {
      reject(fmt::format("input \"{}\": low {}, centre {} and high {} must be finite and low <= high", input.name,
                         input.low, input.centre, input.high));
    }
  }
  for (const OutputColumn& output : outputs) {
    if (!(std::isfinite(output.low) && std::isfinite(output.high) && output.low <= output.high)) {
      reject(fmt::format("output \"{}\": low {} and high {} must be finite and low <= high", output.name, output.low,
                         output.high));
    }
  }
}

void check_regressors(const std::vector<Regressor>& regressors, const std::vector<InputColumn>& inputs) {
  for (const Regressor& regressor : regressors) {
    const bool exists = regressor.input >= 0 && regressor.input < std::ssize(inputs);
    const Eigen::Index levels = exists ? std::ssize(inputs[regressor.input].levels) : 0;
    if (!exists || regressor.level < -1 || regressor.level >= levels || (regressor.level < 0 && levels > 0) ||
        !std::isfinite(regressor.centre)) {
      reject(fmt::format("regressor of input {}, level {}, centre {}: no such input or level, or not finite",
                         regressor.input, regressor.level, regressor.centre));
    }
    const int second = regressor.second_input;
    if (second != -1 && (second < regressor.input || second >= std::ssize(inputs) || regressor.level >= 0 ||
                         inputs[second].is_categorical())) {
      reject(
          fmt::format("regressor of inputs {} and {}: a product is of two numeric inputs, the second not below the "
                      "first",
                      regressor.input, second));
    }
  }
}

}  // namespace

void check_model(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs,
                 const std::vector<Regressor>& regressors, const std::vector<Partition>& partitions) {
  check_columns_of_model(inputs, outputs);
  check_regressors(regressors, inputs);
  std::vector<int> served;
  for (std::size_t i = 0; i < partitions.size(); ++i) {
    check_partition(partitions[i], inputs, std::ssize(regressors), fmt::format("partition {}", i));
    served.insert(served.end(), partitions[i].outputs.begin(), partitions[i].outputs.end());
  }
  check_columns("llmt::Model", "outputs of the partitions", served, std::ssize(outputs));
  if (std::ssize(served) != std::ssize(outputs)) {
    reject(fmt::format("{} of {} outputs have a partition", served.size(), std::ssize(outputs)));
  }
}

}  // namespace llmt
