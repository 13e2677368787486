#include "llmt/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "llmt/limits.hpp"
#include "model/model_checks.hpp"
#include "partition/evaluator.hpp"

namespace llmt {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Cuts the box of a node in two: `box` becomes that of the left child, and that of the right one is returned.
Leaf cut(const Node& node, int index, Leaf& box) {
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
  return right;
}

void describe(const Node& node, const std::vector<Regressor>& regressors, Leaf& leaf) {
  leaf.samples = node.samples;
  leaf.rank = node.rank;
  leaf.rmse = (node.rss / static_cast<double>(std::max<Eigen::Index>(node.samples, 1))).cwiseSqrt();
  leaf.slope = node.slope;
  leaf.intercept = node.value;
  for (std::size_t k = 0; k < regressors.size(); ++k) {
    leaf.intercept -= node.slope.col(k) * regressors[k].centre;
  }
}

std::size_t listed(const Leaf& leaf) {
  std::size_t count = leaf.sides.size();
  for (const std::vector<int>& levels : leaf.levels) {
    count += levels.size();
  }
  return count;
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
  const std::vector<Node>& nodes = partitions_[partition].nodes;
  std::vector<Leaf> result;
  std::vector<Leaf> waiting = {std::move(everywhere)};  // boxes of nodes, the leftmost last
  for (std::size_t count = 0; !waiting.empty();) {
    Leaf box = std::move(waiting.back());
    waiting.pop_back();
    while (!nodes[box.node].is_leaf()) {
      const Node& node = nodes[box.node];
      Leaf right = cut(node, box.node, box);
      right.node = node.right;
      box.node = node.left;
      count += listed(right);
      if (std::cmp_greater(count, most(Limit::listed_sides))) {
        throw std::runtime_error(
            fmt::format("llmt::Model::leaves: the boxes of partition {} are too many to be listed", partition));
      }
      waiting.push_back(std::move(right));
    }
    describe(nodes[box.node], regressors_, box);
    result.push_back(std::move(box));
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
    if (i < inputs.size() && !inputs_[i].codes.empty() && levels[i].empty()) continue;
    if (i >= inputs.size() || levels[i].size() != inputs_[i].levels.size()) {
      throw std::invalid_argument(fmt::format("llmt::Model::named: {} level names for input {}, which has {} levels",
                                              levels[i].size(), i, i < inputs_.size() ? inputs_[i].levels.size() : 0));
    }
    result.inputs_[i].levels = levels[i];
  }
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    result.outputs_[o].name = outputs[o];
  }
  check_names(result.inputs_, result.outputs_);
  return result;
}

}  // namespace llmt
