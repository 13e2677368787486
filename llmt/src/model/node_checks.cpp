// Checks of a model that need one node alone.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/model_checks.hpp"

namespace llmt {
namespace {

void check_direction(const Node& node, const std::vector<InputColumn>& inputs, const ModelPart& part) {
  if (!node.is_oblique()) return;
  if (node.direction.size() != std::ssize(inputs) || !node.direction.allFinite()) {
    throw ModelFault(part, fmt::format("direction has {} entries, it must have {} finite ones", node.direction.size(),
                                       inputs.size()));
  }
  // So it is not zero either, and its split input is a number.
  if (node.direction(node.split_input) == 0.0) {
    throw ModelFault(part, fmt::format("direction has weight 0 for the split input {}", node.split_input));
  }
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    if (inputs[j].is_categorical() && node.direction(j) != 0.0) {
      throw ModelFault(part, fmt::format("direction has weight {} for the categorical input \"{}\", it must be 0",
                                         node.direction(j), inputs[j].name));
    }
  }
}

// Sizes of the local model and of what is known of its rows.
void check_shapes(const Node& node, Eigen::Index outputs, Eigen::Index regressors, const ModelPart& part) {
  if (node.value.size() != outputs || node.rss.size() != outputs || node.slope.rows() != outputs ||
      node.slope.cols() != regressors) {
    throw ModelFault(part, fmt::format("value, rss and slope must have {} outputs and slope {} regression inputs",
                                       outputs, regressors));
  }
  if (node.mean.size() != regressors || node.low.size() != regressors || node.high.size() != regressors) {
    throw ModelFault(part, fmt::format("mean, low and high must have {} regressors", regressors));
  }
}

// A transition where there is none, or one that is wider than the model says: a blend has its validity's width times
// the extent of a part of the input's range.
void check_half_width(const Node& node, const Validity& validity, const std::vector<InputColumn>& inputs,
                      const ModelPart& part) {
  constexpr double rounding = 1.0 + 1e-6;
  if (!(node.half_width >= 0.0 && std::isfinite(node.half_width))) {
    throw ModelFault(part, fmt::format("half_width {} must be finite and not negative", node.half_width));
  }
  if (node.half_width == 0.0 || node.is_leaf() || validity.kind == ValidityKind::logistic) return;
  if (validity.kind != ValidityKind::blend) {
    throw ModelFault(part, fmt::format("half_width is {}, leaves that are {} have no transitions", node.half_width,
                                       name_of(validity.kind)));
  }
  const InputColumn& input = inputs[node.split_input];
  const double most = validity.width * (input.high - input.low) * rounding;
  if (!(node.half_width <= most)) {
    throw ModelFault(part, fmt::format("half_width is {}, with the width {} of the partition at most {} is possible",
                                       node.half_width, validity.width, most));
  }
}

// True if the matrix may be the inverse of sums of squares and products. Others could give a leverage below 0.
bool may_be_inverse_gram(const Eigen::MatrixXd& matrix) {
  constexpr double rounding = 1.0 + 1e-6;
  if (!(matrix(0, 0) > 0.0) || !(matrix.diagonal().array() >= 0.0).all()) return false;
  const Eigen::ArrayXd root = matrix.diagonal().array().sqrt() * std::sqrt(rounding);
  return (matrix.array().abs() <= (root.matrix() * root.matrix().transpose()).array()).all();
}

void check_values(const Node& node, Eigen::Index regressors, const ModelPart& part) {
  if (!(node.low.array() <= node.high.array()).all() || !node.mean.allFinite() || !node.low.allFinite() ||
      !node.high.allFinite()) {
    throw ModelFault(part, "mean, low and high must be finite and low <= high");
  }
  if (!(node.missing_left >= 0.0 && node.missing_left <= 1.0)) {
    throw ModelFault(part, fmt::format("missing_left {} must lie between 0 and 1", node.missing_left));
  }
  if (node.inverse_gram.size() > 0 && (node.inverse_gram.rows() != regressors + 1 ||
                                       node.inverse_gram.cols() != regressors + 1 || !node.inverse_gram.allFinite())) {
    throw ModelFault(part, fmt::format("inverse_gram must be finite, {} x {}", regressors + 1, regressors + 1));
  }
  if (node.inverse_gram.size() > 0 && !may_be_inverse_gram(node.inverse_gram)) {
    throw ModelFault(part, "inverse_gram is no inverse of sums of squares and products: leverages could be negative");
  }
  if (!node.value.allFinite() || !node.slope.allFinite() || !node.rss.allFinite() || !std::isfinite(node.threshold)) {
    throw ModelFault(part, "a number is not finite");
  }
  if (node.samples < 0 || node.rank < 0 || (node.rss.array() < 0.0).any()) {
    throw ModelFault(part, "samples, rank and rss cannot be negative");
  }
  if (node.rank > regressors + 1) {
    throw ModelFault(part, fmt::format("rank {} is above the number of coefficients, {}", node.rank, regressors + 1));
  }
}

void check_split(const Node& node, const std::vector<InputColumn>& inputs, const ModelPart& part) {
  if (node.split_input < 0 || node.split_input >= std::ssize(inputs)) {
    throw ModelFault(
        part, fmt::format("split input {} does not exist, there are {} inputs", node.split_input, inputs.size()));
  }
  const InputColumn& input = inputs[node.split_input];
  if (node.level_side.size() != input.levels.size()) {
    throw ModelFault(part, fmt::format("{} sides for the {} levels of \"{}\"", node.level_side.size(),
                                       input.levels.size(), input.name));
  }
  check_direction(node, inputs, part);
  if (std::ranges::any_of(node.level_side, [](int side) { return side < -1 || side > 1; })) {
    throw ModelFault(part, "the side of a level must be -1, 0 or 1");
  }
}

}  // namespace

void check_node(const Partition& partition, const ModelPart& part, const std::vector<InputColumn>& inputs,
                Eigen::Index regressors) {
  const Node& node = partition.nodes[part.node];
  check_shapes(node, std::ssize(partition.outputs), regressors, part);
  check_values(node, regressors, part);
  if (node.is_leaf()) {
    if (node.right >= 0) throw ModelFault(part, "it has a right child and no left one");
    return;
  }
  // The k-th split makes nodes 2k-1 and 2k, after their parent.
  if (node.left % 2 != 1 || node.right != node.left + 1 || node.left <= part.node ||
      node.right >= std::ssize(partition.nodes)) {
    throw ModelFault(part, fmt::format("the children {} and {} are not in order of growth", node.left, node.right));
  }
  check_split(node, inputs, part);
  check_half_width(node, partition.validity, inputs, part);
}

}  // namespace llmt
