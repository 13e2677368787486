#include "model/model_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string_view>

#include "llmt/limits.hpp"

namespace llmt {
namespace {

// Every node, that each but the root has one parent, and how deep they lie.
void check_tree(const Partition& partition, Eigen::Index index, const std::vector<InputColumn>& inputs,
                Eigen::Index regressors) {
  std::vector<bool> has_parent(partition.nodes.size(), false);
  std::vector<int> splits_above(partition.nodes.size(), 0);
  for (Eigen::Index i = 0; i < std::ssize(partition.nodes); ++i) {
    check_node(partition, {"partition", index, i}, inputs, regressors);
    const Node& node = partition.nodes[i];
    if (!node.is_leaf()) {
      if (has_parent[node.left]) throw ModelFault({"partition", index, node.left}, "it has two parents");
      for (const int child : {node.left, node.right}) {  // which come after their parent
        has_parent[child] = true;
        splits_above[child] = splits_above[i] + 1;
        if (splits_above[child] > most(Limit::model_splits_above_leaf)) {
          throw ModelFault({"partition", index, child},
                           fmt::format("the tree is deeper than {} splits", most(Limit::model_splits_above_leaf)));
        }
      }
    }
  }
  if (std::find(has_parent.begin() + 1, has_parent.end(), false) != has_parent.end()) {
    throw ModelFault({"partition", index}, "a node has no parent");
  }
}

void check_validity(const Partition& partition, const ModelPart& part) {
  const Validity& validity = partition.validity;
  if (!(validity.width >= 0.0 && std::isfinite(validity.width))) {
    throw ModelFault(part, fmt::format("the width {} must be finite and not negative", validity.width));
  }
  if (validity.kind != ValidityKind::gaussian) return;
  if (!std::isnormal(validity.width)) {
    throw ModelFault(part, fmt::format("the width {} of Gaussians must be positive", validity.width));
  }
  if (std::ranges::any_of(partition.nodes, [](const Node& node) { return node.is_oblique(); })) {
    throw ModelFault(part, "Gaussians need boxes, and a node has a direction");
  }
}

void check_output_range(const Partition& partition, const ModelPart& part) {
  const Eigen::MatrixXd& range = partition.output_range;
  if (range.size() == 0) return;
  const auto is_one = [](double low, double high) {
    const bool is_open = low == -std::numeric_limits<double>::infinity() && high == -low;
    return is_open || (std::isfinite(low) && std::isfinite(high) && low <= high);
  };
  bool fits = range.rows() == std::ssize(partition.outputs) && range.cols() == 2;
  for (Eigen::Index o = 0; fits && o < range.rows(); ++o) fits = is_one(range(o, 0), range(o, 1));
  if (!fits) {
    throw ModelFault(part,
                     fmt::format("output_range must be finite or open, {} x 2, low <= high", partition.outputs.size()));
  }
}

void check_partition(const Partition& partition, Eigen::Index index, const std::vector<InputColumn>& inputs,
                     Eigen::Index regressors) {
  const ModelPart part{"partition", index};
  if (partition.outputs.empty() || partition.nodes.empty() || partition.nodes.size() % 2 == 0) {
    throw ModelFault(part, "it needs an output and an odd number of nodes");
  }
  check_validity(partition, part);
  if (partition.outer_slope.size() > 0 &&
      (partition.outer_slope.rows() != std::ssize(partition.outputs) || partition.outer_slope.cols() != regressors ||
       !partition.outer_slope.allFinite())) {
    throw ModelFault(part, fmt::format("outer_slope must be finite, {} x {}", partition.outputs.size(), regressors));
  }
  if (partition.residual_range.size() > 0 &&
      (partition.residual_range.rows() != std::ssize(partition.outputs) || partition.residual_range.cols() != 2 ||
       !partition.residual_range.allFinite() ||
       (partition.residual_range.col(0).array() > partition.residual_range.col(1).array()).any())) {
    throw ModelFault(part, fmt::format("residual_range must be finite, {} x 2, low <= high", partition.outputs.size()));
  }
  check_output_range(partition, part);
  check_tree(partition, index, inputs, regressors);
}

bool is_finite(double value) { return std::isfinite(value); }

void check_columns_of_model(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs) {
  if (inputs.empty() || outputs.empty()) {
    throw ModelFault(
        {}, fmt::format("it has {} inputs and {} outputs, both must be at least 1", inputs.size(), outputs.size()));
  }
  for (Eigen::Index i = 0; i < std::ssize(inputs); ++i) {
    const InputColumn& input = inputs[i];
    if (!(std::isfinite(input.low) && std::isfinite(input.centre) && std::isfinite(input.high) &&
          input.low <= input.high)) {
      throw ModelFault({"input", i}, fmt::format("\"{}\": low {}, centre {} and high {} must be finite and low <= high",
                                                 input.name, input.low, input.centre, input.high));
    }
    if (std::ssize(input.levels) > most(Limit::categories) + (input.has_empty_level() ? 1 : 0)) {
      throw ModelFault({"input", i}, fmt::format("\"{}\": {} levels, at most {} are possible", input.name,
                                                 input.levels.size(), most(Limit::categories)));
    }
    const std::vector<double>& codes = input.codes;
    const bool ascend = std::ranges::is_sorted(codes, std::less_equal<>()) && std::ranges::all_of(codes, is_finite);
    if (!codes.empty() && (codes.size() + (input.has_empty_level() ? 1 : 0) != input.levels.size() || !ascend)) {
      throw ModelFault({"input", i}, fmt::format("\"{}\": {} codes for {} levels; they must be finite, and ascend",
                                                 input.name, codes.size(), input.levels.size()));
    }
  }
  for (Eigen::Index o = 0; o < std::ssize(outputs); ++o) {
    const OutputColumn& output = outputs[o];
    if (!(std::isfinite(output.low) && std::isfinite(output.high) && output.low <= output.high)) {
      throw ModelFault({"output", o}, fmt::format("\"{}\": low {} and high {} must be finite and low <= high",
                                                  output.name, output.low, output.high));
    }
  }
}

void check_regressors(const std::vector<Regressor>& regressors, const std::vector<InputColumn>& inputs) {
  for (Eigen::Index k = 0; k < std::ssize(regressors); ++k) {
    const Regressor& regressor = regressors[k];
    const bool exists = regressor.input >= 0 && regressor.input < std::ssize(inputs);
    const Eigen::Index levels = exists ? std::ssize(inputs[regressor.input].levels) : 0;
    if (!exists || regressor.level < -1 || regressor.level >= levels || (regressor.level < 0 && levels > 0) ||
        !std::isfinite(regressor.centre)) {
      throw ModelFault({"regressor", k},
                       fmt::format("input {}, level {}, centre {}: no such input or level, or not finite",
                                   regressor.input, regressor.level, regressor.centre));
    }
    const int second = regressor.second_input;
    if (second != -1 && (second < regressor.input || second >= std::ssize(inputs) || regressor.level >= 0 ||
                         inputs[second].is_categorical())) {
      throw ModelFault({"regressor", k}, fmt::format("inputs {} and {}: a product is of two numeric inputs, the second "
                                                     "not below the first",
                                                     regressor.input, second));
    }
  }
}

// Each output has one partition.
void check_outputs(const std::vector<Partition>& partitions, Eigen::Index outputs) {
  std::vector<bool> served(outputs, false);
  Eigen::Index count = 0;
  for (Eigen::Index p = 0; p < std::ssize(partitions); ++p) {
    for (const int output : partitions[p].outputs) {
      if (output < 0 || output >= outputs) {
        throw ModelFault({"partition", p}, fmt::format("output {} does not exist, there are {}", output, outputs));
      }
      if (served[output]) throw ModelFault({"partition", p}, fmt::format("output {} has two partitions", output));
      served[output] = true;
      ++count;
    }
  }
  if (count != outputs) throw ModelFault({}, fmt::format("{} of {} outputs have a partition", count, outputs));
}

// The position of the first name that stands there before; -1 if there is none.
template <class Range, class NameOf>
Eigen::Index first_repeated(const Range& range, const NameOf& name_of) {
  std::set<std::string_view> seen;
  Eigen::Index at = 0;
  for (const auto& entry : range) {
    if (!seen.insert(name_of(entry)).second) return at;
    ++at;
  }
  return -1;
}

}  // namespace

std::string ModelPart::words() const {
  if (list[0] == '\0') return "";
  return node < 0 ? fmt::format("{} {}: ", list, index) : fmt::format("{} {} node {}: ", list, index, node);
}

std::string ModelPart::pointer() const {
  if (list[0] == '\0') return "";
  return node < 0 ? fmt::format("/{}s/{}", list, index) : fmt::format("/{}s/{}/nodes/{}", list, index, node);
}

void check_names(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs) {
  if (const Eigen::Index i =
          first_repeated(inputs, [](const InputColumn& input) { return std::string_view(input.name); });
      i >= 0) {
    throw ModelFault({"input", i}, fmt::format("two inputs have the name \"{}\"", inputs[i].name));
  }
  if (const Eigen::Index o =
          first_repeated(outputs, [](const OutputColumn& output) { return std::string_view(output.name); });
      o >= 0) {
    throw ModelFault({"output", o}, fmt::format("two outputs have the name \"{}\"", outputs[o].name));
  }
  for (Eigen::Index i = 0; i < std::ssize(inputs); ++i) {
    const std::vector<std::string>& levels = inputs[i].levels;
    if (const Eigen::Index k = first_repeated(levels, [](const std::string& name) { return std::string_view(name); });
        k >= 0) {
      throw ModelFault({"input", i}, fmt::format("two levels have the name \"{}\"", levels[k]));
    }
  }
}

void check_model(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs,
                 const std::vector<Regressor>& regressors, const std::vector<Partition>& partitions) {
  check_columns_of_model(inputs, outputs);
  check_names(inputs, outputs);
  check_regressors(regressors, inputs);
  const std::vector<RegressorRange> ranges = check_centres(inputs, regressors);
  for (Eigen::Index p = 0; p < std::ssize(partitions); ++p) {
    check_partition(partitions[p], p, inputs, std::ssize(regressors));
  }
  check_outputs(partitions, std::ssize(outputs));
  for (Eigen::Index p = 0; p < std::ssize(partitions); ++p) {
    check_plausible(partitions[p], p, ranges, outputs);
  }
}

}  // namespace llmt
