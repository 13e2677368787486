#include "llmt/spread.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace llmt {
namespace {

constexpr double largest_spread = 1e6;

[[noreturn]] void refuse(const std::string& problem) { throw std::invalid_argument("llmt::Spread: " + problem); }

void check_levels(const Spread& spread, const std::vector<InputColumn>& inputs) {
  if (spread.levels.size() != inputs.size()) {
    refuse(fmt::format("{} lists of levels for {} inputs", spread.levels.size(), inputs.size()));
  }
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    const std::size_t levels = inputs[j].levels.size();
    const std::vector<double>& values = spread.levels[j];
    if (values.size() != (levels > 0 ? levels + 1 : 0)) {
      refuse(fmt::format("{} values of input {}, which has {} levels", values.size(), j, levels));
    }
    if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) {
      refuse(fmt::format("a value of a level of input {} is not finite", j));
    }
  }
}

double value_of(const Spread& spread, int column, double value) {
  const std::vector<double>& levels = spread.levels[column];
  if (levels.empty()) return value;
  const auto others = static_cast<double>(levels.size() - 1);
  return value >= 0.0 && value < others ? levels[static_cast<std::size_t>(value)] : levels.back();
}

}  // namespace

double spread_at(const Spread& spread, const Eigen::Ref<const Eigen::MatrixXd>& inputs, Eigen::Index row,
                 double prediction) {
  if (spread.nodes.empty()) return 1.0;
  const SpreadNode* node = &spread.nodes.front();
  while (!node->is_leaf()) {
    const bool is_input = node->column < inputs.cols();
    const double value = is_input ? value_of(spread, node->column, inputs(row, node->column)) : prediction;
    const bool is_left = std::isnan(value) ? node->missing_left : value <= node->threshold;
    node = &spread.nodes[is_left ? node->left : node->right];
  }
  return node->factor;
}

double factor_of_weight(const Spread& spread, double weight) {
  return std::sqrt(1.0 - spread.noise_share + spread.noise_share * spread.usual_weight / weight);
}

void check_row_weights(const char* what, const Eigen::VectorXd& weights, Eigen::Index rows) {
  if (weights.size() == 0) return;
  if (weights.size() != rows) {
    throw std::invalid_argument(fmt::format("{}: there are {} weights for {} rows", what, weights.size(), rows));
  }
  for (Eigen::Index row = 0; row < rows; ++row) {
    if (weights(row) > 0.0 && std::isfinite(weights(row))) continue;
    throw std::invalid_argument(fmt::format("{}: weights({}) is {}, it must be positive", what, row, weights(row)));
  }
}

Eigen::MatrixXd with_empty_levels(const std::vector<InputColumn>& columns,
                                  const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  Eigen::MatrixXd result = inputs;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    if (!columns[j].has_empty_level()) continue;
    const auto level = static_cast<double>(columns[j].levels.size() - 1);
    for (double& value : result.col(static_cast<Eigen::Index>(j))) value = std::isnan(value) ? level : value;
  }
  return result;
}

void check_spread(const Spread& spread, const std::vector<InputColumn>& inputs) {
  if (!(spread.noise_share >= 0.0 && spread.noise_share <= 1.0)) {
    refuse(fmt::format("the share of noise is {}, it must be from 0 to 1", spread.noise_share));
  }
  if (!(spread.usual_weight > 0.0 && std::isfinite(spread.usual_weight))) {
    refuse(fmt::format("the usual weight is {}, it must be positive", spread.usual_weight));
  }
  if (spread.nodes.empty()) {
    if (!spread.levels.empty()) refuse("it has levels and no nodes");
    return;
  }
  check_levels(spread, inputs);
  const auto count = static_cast<int>(spread.nodes.size());
  std::vector<int> parents(spread.nodes.size(), 0);
  for (int i = 0; i < count; ++i) {
    const SpreadNode& node = spread.nodes[i];
    if (node.is_leaf()) {
      if (!(node.factor > 0.0 && node.factor <= largest_spread)) {
        refuse(fmt::format("the factor {} of node {} must be positive and at most {}", node.factor, i, largest_spread));
      }
      continue;
    }
    if (node.column < 0 || node.column > std::ssize(inputs) || !std::isfinite(node.threshold)) {
      refuse(fmt::format("node {} has no such column, or no threshold", i));
    }
    for (const int child : {node.left, node.right}) {
      if (child <= i || child >= count) refuse(fmt::format("child {} of node {} must come later", child, i));
      ++parents[child];
    }
  }
  if (parents.front() != 0 || std::any_of(parents.begin() + 1, parents.end(), [](int each) { return each != 1; })) {
    refuse("each node but the first needs one parent");
  }
}

}  // namespace llmt
