// Trends of a readable tree: slopes with the signs that are asked for, and no step against them at a threshold.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "readable/equation_tree.hpp"

namespace llmt {
namespace {

// A fall below this part of the predictions' magnitude is rounding.
constexpr double rounding_of_order = 1e-12;

// How far beyond the training extent an input still moves a prediction, as a part of its range (B.1).
constexpr double reach_beyond = 0.05;

// Where a node holds.
struct Box {
  Eigen::VectorXd low;
  Eigen::VectorXd high;
  std::vector<std::vector<char>> levels;  // of each categorical input
};

std::vector<Box> node_boxes(const std::vector<Node>& nodes, const std::vector<int>& there, const std::vector<int>& tree,
                            const std::vector<int>& num_levels) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const auto inputs = static_cast<Eigen::Index>(num_levels.size());
  std::vector<Box> boxes(nodes.size());
  boxes[0] = {Eigen::VectorXd::Constant(inputs, -infinity), Eigen::VectorXd::Constant(inputs, infinity), {}};
  for (const int levels : num_levels) boxes[0].levels.emplace_back(static_cast<std::size_t>(levels), char{1});
  for (const int i : there) {
    if (tree[i] != stays_split) continue;
    const Node& node = nodes[i];
    boxes[node.left] = boxes[node.right] = boxes[i];
    for (std::size_t level = 0; level < node.level_side.size(); ++level) {
      const int side = node.level_side[level];
      if (side == 0) continue;
      boxes[side < 0 ? node.right : node.left].levels[node.split_input][level] = 0;
    }
    if (!node.level_side.empty()) continue;
    double& high = boxes[node.left].high(node.split_input);
    double& low = boxes[node.right].low(node.split_input);
    high = std::min(high, node.threshold);
    low = std::max(low, node.threshold);
  }
  return boxes;
}

std::vector<int> leaves_below(const std::vector<Node>& nodes, const std::vector<int>& tree, int node) {
  if (tree[node] != stays_split) return {node};
  std::vector<int> leaves = leaves_below(nodes, tree, nodes[node].left);
  const std::vector<int> right = leaves_below(nodes, tree, nodes[node].right);
  leaves.insert(leaves.end(), right.begin(), right.end());
  return leaves;
}

}  // namespace

// The selection of a node in which every model on the way has slopes with the signs: a term whose least-squares slope
// has the wrong one is left out, and the selection made anew.
SelectionPath EquationTree::signed_path(const LocalSums& sums, Eigen::Index most) const {
  LocalSums kept = sums;
  while (true) {
    SelectionPath path = selection_path(kept, most, parents_);
    const Eigen::Index wrong = grains_.signs.empty() ? -1 : wrong_term(sums, path);
    if (wrong < 0) return path;
    kept.gram.row(wrong + 1).setZero();
    kept.gram.col(wrong + 1).setZero();
    kept.products.row(wrong + 1).setZero();
  }
}

Eigen::Index EquationTree::wrong_term(const LocalSums& sums, const SelectionPath& path) const {
  for (std::size_t count = 1; count <= path.regressors.size(); ++count) {
    std::vector<Eigen::Index> columns = {0};
    for (std::size_t k = 0; k < count; ++k) columns.push_back(path.regressors[k] + 1);
    const Eigen::MatrixXd solution =
        Eigen::LDLT<Eigen::MatrixXd>(sums.gram(columns, columns)).solve(sums.products(columns, Eigen::all));
    for (std::size_t k = 0; k < count; ++k) {
      const int sign = grains_.signs[path.regressors[k]];
      if ((sign * solution.row(static_cast<Eigen::Index>(k) + 1).array() < 0.0).any()) return path.regressors[k];
    }
  }
  return -1;
}

std::vector<int> EquationTree::pruned(double price) {
  std::vector<int> tree = cheapest_tree(priced_, price);
  if (sample_.described.table->monotone.empty()) return tree;
  for (int split = last_disorder(tree); split >= 0; split = last_disorder(tree)) {
    const PricedNode& node = priced_[split];
    const auto cost = [&](std::size_t k) { return node.errors[k] + price * static_cast<double>(node.sizes[k]); };
    tree[split] = 0;
    for (std::size_t k = 1; k < node.errors.size(); ++k) {
      if (cost(k) < cost(tree[split])) tree[split] = static_cast<int>(k);
    }
  }
  return tree;
}

// The last split on a monotone input at which a prediction steps against the trend; -1: none.
int EquationTree::last_disorder(const std::vector<int>& tree) {
  const std::vector<int>& monotone = sample_.described.table->monotone;
  const std::vector<int> there = nodes_of(priced_, tree);
  const std::vector<Box> boxes = node_boxes(nodes_, there, tree, sample_.described.table->num_levels);
  const std::vector<InputColumn>& columns = sample_.described.columns;
  const auto falls = [&](int left, int right, int input, double threshold) {
    const Equation& below = made(left, tree[left]).equation;
    const Equation& above = made(right, tree[right]).equation;
    for (Eigen::Index o = 0; o < below.intercept.size(); ++o) {
      double least = monotone[input] * (above.intercept(o) - below.intercept(o));
      double magnitude = std::abs(above.intercept(o)) + std::abs(below.intercept(o));
      // Slopes of the difference, by input.
      std::vector<std::vector<std::pair<Eigen::Index, double>>> slopes(columns.size());
      for (const auto& [equation, sign] : {std::pair{&above, 1.0}, {&below, -1.0}}) {
        for (std::size_t t = 0; t < equation->terms.size(); ++t) {
          const Eigen::Index term = equation->terms[t];
          slopes[sample_.described.regressors[terms_[term].first].input].emplace_back(
              term, sign * monotone[input] * equation->slope(o, static_cast<Eigen::Index>(t)));
        }
      }
      for (std::size_t i = 0; i < columns.size(); ++i) {
        const auto j = static_cast<Eigen::Index>(i);
        const InputColumn& column = columns[i];
        // The part of an input at a value; without one it stands at its mean.
        const auto part = [&](double value) {
          double sum = 0.0;
          for (const auto& [term, slope] : slopes[i]) {
            const int level = sample_.described.regressors[terms_[term].first].level;
            sum += slope * (std::isnan(value) ? origin_.terms(term) : level < 0 ? value : value == level ? 1.0 : 0.0);
          }
          return sum;
        };
        if (static_cast<int>(i) == input) {
          least += part(threshold);
          magnitude += std::abs(part(threshold));
          continue;
        }
        double smallest = part(std::nan(""));
        if (column.is_categorical()) {
          for (std::size_t level = 0; level < column.levels.size(); ++level) {
            if (boxes[left].levels[i][level] != 0 && boxes[right].levels[i][level] != 0)
              smallest = std::min(smallest, part(static_cast<double>(level)));
          }
        } else {
          const double low = std::max(boxes[left].low(j), boxes[right].low(j));
          const double high = std::min(boxes[left].high(j), boxes[right].high(j));
          if (low >= high) return false;  // they do not meet
          const double reach = reach_beyond * (column.high - column.low);
          for (const double end : {std::clamp(low, column.low - reach, column.high + reach),
                                   std::clamp(high, column.low - reach, column.high + reach)})
            smallest = std::min(smallest, part(end));
        }
        least += smallest;
        magnitude += std::abs(smallest);
      }
      if (least < -rounding_of_order * magnitude) return true;
    }
    return false;
  };
  for (std::size_t k = there.size(); k-- > 0;) {
    const int split = there[k];
    const Node& node = nodes_[split];
    if (tree[split] != stays_split || monotone[node.split_input] == 0) continue;
    for (const int left : leaves_below(nodes_, tree, node.left)) {
      if (boxes[left].high(node.split_input) < node.threshold) continue;
      for (const int right : leaves_below(nodes_, tree, node.right)) {
        if (boxes[right].low(node.split_input) > node.threshold) continue;
        if (falls(left, right, node.split_input, node.threshold)) return split;
      }
    }
  }
  return -1;
}

}  // namespace llmt
