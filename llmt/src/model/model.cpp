#include "llmt/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "model/evaluator.hpp"
#include "model/model_checks.hpp"

namespace llmt {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

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
  check_model(inputs_, outputs_, regressors_, partitions_);
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
