// The pruned and rounded tree as a partition of a model.
#include <algorithm>
#include <tuple>

#include "base/count.hpp"
#include "readable/equation_tree.hpp"

namespace llmt {

std::vector<Term> EquationTree::products_in(const std::vector<int>& tree) const {
  std::vector<bool> used(terms_.size(), false);
  for (const int node : nodes_of(priced_, tree)) {
    for (int t = 0; t < equation_of(tree, node); ++t) used[paths_[node].regressors[t]] = true;
  }
  std::vector<Term> products;
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    if (used[t] && terms_[t].second >= 0) products.push_back(terms_[t]);
  }
  return products;
}

// A node of the rounded tree, still without children.
Node EquationTree::described(int i, int terms, const std::vector<Term>& products) {
  const std::vector<Regressor>& regressors = sample_.described.regressors;
  const Eigen::Index columns = std::ssize(regressors) + std::ssize(products);
  const Equation& equation = made(i, terms).equation;
  Node node;
  node.samples = std::ssize(training_[i]);
  node.rank = 1 + terms;
  node.value = equation.intercept;
  node.slope = Eigen::MatrixXd::Zero(equation.slope.rows(), columns);
  node.rss = Eigen::VectorXd::Zero(equation.slope.rows());
  for (std::size_t t = 0; t < equation.terms.size(); ++t) {
    const Term& term = terms_[equation.terms[t]];
    const auto is_term = [&](const Term& other) { return other.first == term.first && other.second == term.second; };
    const Eigen::Index column =
        term.second < 0 ? term.first
                        : std::ssize(regressors) + (std::ranges::find_if(products, is_term) - products.begin());
    node.slope.col(column) = equation.slope.col(t);
    node.value += equation.slope.col(t) * origin_.terms(equation.terms[t]);
  }
  // The mean stands for a missing value, and no guard acts within the training extent.
  node.mean = node.low = node.high = Eigen::VectorXd::Zero(columns);
  const auto range = [&](int k) {
    const Regressor& regressor = regressors[k];
    const InputColumn& input = sample_.described.columns[regressor.input];
    return regressor.level >= 0 ? std::pair{-regressor.centre, 1.0 - regressor.centre}
                                : std::pair{input.low - regressor.centre, input.high - regressor.centre};
  };
  for (int k = 0; k < count_of(regressors); ++k) std::tie(node.low(k), node.high(k)) = range(k);
  for (std::size_t k = 0; k < products.size(); ++k) {
    const auto [a, b] = range(products[k].first);
    const auto [c, d] = range(products[k].second);
    std::tie(node.low(regressors.size() + k), node.high(regressors.size() + k)) =
        std::minmax({a * c, a * d, b * c, b * d});
  }
  return node;
}

Partition EquationTree::partition(const std::vector<int>& tree, const std::vector<Term>& products) {
  Partition result{.outputs = sample_.outputs, .validity = {}, .nodes = {described(0, equation_of(tree, 0), products)}};
  std::vector<int> splits;
  for (const int node : nodes_of(priced_, tree)) {
    if (tree[node] == stays_split) splits.push_back(node);
  }
  // In the order of growth, in which children are numbered.
  std::ranges::sort(splits, {}, [&](int node) { return nodes_[node].left; });
  std::vector<int> place(nodes_.size(), 0);
  for (const int split : splits) {
    Node& node = result.nodes[place[split]];
    node.left = count_of(result.nodes);
    node.right = node.left + 1;
    node.split_input = nodes_[split].split_input;
    node.threshold = nodes_[split].threshold;
    node.level_side = nodes_[split].level_side;
    node.missing_left = nodes_[split].missing_left;
    for (const int child : {nodes_[split].left, nodes_[split].right}) {
      place[child] = count_of(result.nodes);
      result.nodes.push_back(described(child, equation_of(tree, child), products));
    }
  }
  // A single equation holds everywhere. Of several none is carried beyond the training extent.
  if (!splits.empty())
    result.outer_slope = Eigen::MatrixXd::Zero(result.nodes[0].slope.rows(), result.nodes[0].slope.cols());
  return result;
}

}  // namespace llmt
