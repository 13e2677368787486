// What the pruned and rounded tree costs: its size, and its errors on held-out rows.
#include <algorithm>

#include "partition/smooth_clamp.hpp"
#include "readable/equation_tree.hpp"

namespace llmt {

const EquationTree::Made& EquationTree::made(int node, int terms) {
  const auto [found, is_new] = made_.try_emplace({node, terms});
  if (is_new) {
    found->second.equation = rounded_equation(sums_[node], paths_[node], terms, origin_, grains_, parents_);
    found->second.held_out_error = held_out_error(node, found->second.equation);
  }
  return found->second;
}

// A term at a held-out row, as a deviation, by the guards that partition() leaves: numbers are held to the training
// extent, except where the root is the only leaf.
double EquationTree::held_term(const Term& term, const double* row, bool is_root) const {
  const std::vector<InputColumn>& columns = sample_.described.columns;
  const std::vector<Regressor>& regressors = sample_.described.regressors;
  const Regressor& regressor = regressors[term.first];
  const InputColumn& column = columns[regressor.input];
  if (term.second >= 0) {
    const InputColumn& second = columns[regressors[term.second].input];
    return std::clamp(row[term.first], column.low - column.centre, column.high - column.centre) *
           std::clamp(row[term.second], second.low - second.centre, second.high - second.centre);
  }
  if (is_root || regressor.level >= 0) return row[term.first];
  return smooth_clamp(row[term.first], column.low - column.centre, column.high - column.centre);
}

double EquationTree::held_out_error(int node, const Equation& equation) const {
  const RowValues& values = sample_.held_out;
  return sum_of_rows(std::ssize(held_out_[node]), [&](Eigen::Index i) {
    const int row = held_out_[node][i];
    const double* deviations = values.deviations.row(row).data();
    Eigen::VectorXd error = values.outputs.row(row).transpose() - equation.intercept;
    for (std::size_t t = 0; t < equation.terms.size(); ++t) {
      const Eigen::Index term = equation.terms[t];
      error -= equation.slope.col(t) * (held_term(terms_[term], deviations, node == 0) + origin_.terms(term));
    }
    return values.weights(row) * sample_.output_weights.dot(error.cwiseAbs2());
  });
}

double EquationTree::held_out_error(const std::vector<int>& tree) {
  double sum = 0.0;
  for (const int node : nodes_of(priced_, tree)) {
    if (tree[node] != stays_split) sum += made(node, tree[node]).held_out_error;
  }
  return sum;
}

TreeExtent EquationTree::extent(const std::vector<int>& tree) {
  TreeExtent extent;
  for (const int node : nodes_of(priced_, tree)) {
    if (tree[node] == stays_split) {
      extent.size += priced_[node].split_size;
      continue;
    }
    const Equation& equation = made(node, tree[node]).equation;
    extent.size += equation.slope.rows();
    Eigen::Index terms = 0;
    for (std::size_t t = 0; t < equation.terms.size(); ++t) {
      const Eigen::Index used = (equation.slope.col(t).array() != 0.0).count();
      extent.size += used * size_of_term(sample_, terms_[equation.terms[t]]);
      terms += used > 0 ? 1 : 0;
    }
    ++extent.rules;
    extent.most_terms = std::max(extent.most_terms, terms);
  }
  return extent;
}

}  // namespace llmt
