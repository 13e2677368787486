#include "llmt/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/checks.hpp"
#include "model/evaluator.hpp"

namespace llmt {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

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

void check_node(const Partition& partition, Eigen::Index index, const std::vector<InputColumn>& inputs,
                Eigen::Index regressors, const std::string& where) {
  const Node& node = partition.nodes[index];
  const Eigen::Index outputs = std::ssize(partition.outputs);
  if (node.value.size() != outputs || node.rss.size() != outputs || node.slope.rows() != outputs ||
      node.slope.cols() != regressors) {
    reject(fmt::format("{}: value, rss and slope must have {} outputs and slope {} regression inputs", where, outputs,
                       regressors));
  }
  if (node.mean.size() != regressors || node.low.size() != regressors || node.high.size() != regressors) {
    reject(fmt::format("{}: mean, low and high must have {} regressors", where, regressors));
  }
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

// Nodes of the leaves from left to right, with their boxes.
void collect_leaves(const Partition& partition, int index, Leaf box, const std::vector<InputColumn>& inputs,
                    const std::vector<Regressor>& regressors, std::vector<Leaf>& leaves) {
  const Node& node = partition.nodes[index];
  if (!node.is_leaf()) {
    Leaf right = box;
    if (node.is_oblique()) {
      box.sides.push_back({index, true});
      right.sides.push_back({index, false});
    } else if (node.level_side.empty()) {
      box.high(node.split_input) = std::min(box.high(node.split_input), node.threshold);
      right.low(node.split_input) = std::max(right.low(node.split_input), node.threshold);
    } else {
      const std::size_t input = node.split_input;
      std::vector<int> all = box.levels[input];
      if (all.empty()) {
        for (int level = 0; level < std::ssize(node.level_side); ++level) {
          all.push_back(level);
        }
      }
      const auto keep = [&](std::vector<int>& kept, int side) {
        kept.clear();
        std::ranges::copy_if(all, std::back_inserter(kept), [&](int level) { return node.level_side[level] == side; });
      };
      keep(box.levels[input], -1);
      keep(right.levels[input], 1);
    }
    collect_leaves(partition, node.left, std::move(box), inputs, regressors, leaves);
    collect_leaves(partition, node.right, std::move(right), inputs, regressors, leaves);
    return;
  }
  box.node = index;
  box.samples = node.samples;
  box.rank = node.rank;
  box.rmse = (node.rss / static_cast<double>(std::max<Eigen::Index>(node.samples, 1))).cwiseSqrt();
  box.slope = node.slope;
  box.intercept = node.value;
  for (std::size_t k = 0; k < regressors.size(); ++k) {
    box.intercept -= node.slope.col(k) * regressors[k].centre;
  }
  leaves.push_back(std::move(box));
}

}  // namespace

Model::Model(std::vector<InputColumn> inputs, std::vector<OutputColumn> outputs, std::vector<Regressor> regressors,
             std::vector<Partition> partitions)
    : inputs_(std::move(inputs)),
      outputs_(std::move(outputs)),
      regressors_(std::move(regressors)),
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
  for (const Regressor& regressor : regressors_) {
    const bool exists = regressor.input >= 0 && regressor.input < num_inputs();
    const Eigen::Index levels = exists ? std::ssize(inputs_[regressor.input].levels) : 0;
    if (!exists || regressor.level < -1 || regressor.level >= levels || (regressor.level < 0 && levels > 0) ||
        !std::isfinite(regressor.centre)) {
      reject(fmt::format("regressor of input {}, level {}, centre {}: no such input or level, or not finite",
                         regressor.input, regressor.level, regressor.centre));
    }
    const int second = regressor.second_input;
    if (second != -1 && (second < regressor.input || second >= num_inputs() || regressor.level >= 0 ||
                         inputs_[second].is_categorical())) {
      reject(
          fmt::format("regressor of inputs {} and {}: a product is of two numeric inputs, the second not below the "
                      "first",
                      regressor.input, second));
    }
  }
  std::vector<int> served;
  for (std::size_t i = 0; i < partitions_.size(); ++i) {
    check_partition(partitions_[i], inputs_, std::ssize(regressors_), fmt::format("partition {}", i));
    served.insert(served.end(), partitions_[i].outputs.begin(), partitions_[i].outputs.end());
  }
  check_columns("llmt::Model", "outputs of the partitions", served, num_outputs());
  if (std::ssize(served) != num_outputs()) {
    reject(fmt::format("{} of {} outputs have a partition", served.size(), num_outputs()));
  }
  std::vector<Evaluator> evaluators;
  for (const Partition& partition : partitions_) {
    evaluators.emplace_back(partition, inputs_, std::ssize(regressors_));
  }
  evaluators_ = std::make_shared<const std::vector<Evaluator>>(std::move(evaluators));
}

std::vector<Leaf> Model::leaves(Eigen::Index partition) const {
  if (partition < 0 || partition >= std::ssize(partitions_)) {
    throw std::invalid_argument(
        fmt::format("llmt::Model::leaves: partition is {}, the model has {}", partition, partitions_.size()));
  }
  Leaf everywhere;
  everywhere.low = Eigen::VectorXd::Constant(num_inputs(), -infinity);
  everywhere.high = Eigen::VectorXd::Constant(num_inputs(), infinity);
  everywhere.levels.resize(inputs_.size());
  std::vector<Leaf> result;
  collect_leaves(partitions_[partition], 0, everywhere, inputs_, regressors_, result);
  return result;
}

Partition prefix(const Partition& partition, Eigen::Index max_leaves) {
  if (max_leaves < 1) {
    throw std::invalid_argument(fmt::format("llmt::prefix: max_leaves is {}, it must be at least 1", max_leaves));
  }
  const Eigen::Index kept = 2 * std::min(max_leaves, partition.num_leaves()) - 1;
  Partition result{.outputs = partition.outputs,
                   .validity = partition.validity,
                   .nodes = {partition.nodes.begin(), partition.nodes.begin() + kept},
                   .outer_slope = partition.outer_slope,
                   .residual_range = partition.residual_range};
  for (Node& node : result.nodes) {
    if (node.left >= kept) {
      make_leaf(node);
    }
  }
  return result;
}

Model Model::prefix(Eigen::Index max_leaves) const {
  std::vector<Partition> partitions;
  for (const Partition& partition : partitions_) {
    partitions.push_back(llmt::prefix(partition, max_leaves));
  }
  return {inputs_, outputs_, regressors_, std::move(partitions)};
}

Model Model::named(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs,
                   const std::vector<std::vector<std::string>>& levels) const {
  if (std::ssize(inputs) != num_inputs() || std::ssize(outputs) != num_outputs()) {
    throw std::invalid_argument(
        fmt::format("llmt::Model::named: {} input and {} output names for {} inputs and {} outputs", inputs.size(),
                    outputs.size(), num_inputs(), num_outputs()));
  }
  Model result = *this;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    result.inputs_[i].name = inputs[i];
  }
  for (std::size_t i = 0; i < levels.size(); ++i) {
    if (i >= inputs.size() || levels[i].size() != inputs_[i].levels.size()) {
      throw std::invalid_argument(fmt::format("llmt::Model::named: {} level names for input {}, which has {} levels",
                                              levels[i].size(), i, i < inputs_.size() ? inputs_[i].levels.size() : 0));
    }
    result.inputs_[i].levels = levels[i];
  }
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    result.outputs_[o].name = outputs[o];
  }
  return result;
}

}  // namespace llmt
