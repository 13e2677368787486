#include "model/incomplete.hpp"

#include <cmath>

namespace llmt {
namespace {

void mark_split(const Node& node, std::vector<bool>& used) {
  used[node.split_input] = true;
  for (Eigen::Index j = 0; j < node.direction.size(); ++j) {
    if (node.direction(j) != 0.0) used[j] = true;
  }
}

void mark_slopes(const Model& model, const Node& leaf, std::vector<bool>& used) {
  for (Eigen::Index k = 0; k < leaf.slope.cols(); ++k) {
    if (leaf.slope.col(k).isZero(0.0)) continue;
    const Regressor& regressor = model.regressors()[k];
    used[regressor.input] = true;
    if (regressor.second_input >= 0) used[regressor.second_input] = true;
  }
}

bool is_missing(const InputColumn& input, double value) {
  if (std::isnan(value)) return !input.has_empty_level();
  if (!input.is_categorical() || !input.codes.empty()) return false;  // of codes the nearest counts
  return !(value >= 0.0 && value < static_cast<double>(input.levels.size()));
}

}  // namespace

std::vector<bool> used_inputs(const Model& model) {
  std::vector<bool> used(model.inputs().size(), false);
  for (const Partition& partition : model.partitions()) {
    for (const Node& node : partition.nodes) {
      node.is_leaf() ? mark_slopes(model, node, used) : mark_split(node, used);
    }
  }
  return used;
}

std::vector<bool> incomplete_rows(const std::vector<Model>& models, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  std::vector<bool> incomplete(inputs.rows(), false);
  for (const Model& model : models) {
    const std::vector<bool> used = used_inputs(model);
    for (Eigen::Index j = 0; j < inputs.cols(); ++j) {
      for (Eigen::Index row = 0; used[j] && row < inputs.rows(); ++row) {
        if (is_missing(model.inputs()[j], inputs(row, j))) incomplete[row] = true;
      }
    }
  }
  return incomplete;
}

}  // namespace llmt
