#include "readable/input_walk.hpp"

#include <algorithm>
#include <cmath>

#include "base/count.hpp"
#include "data/fewer_inputs.hpp"
#include "data/regressors.hpp"
#include "growth/rules/rule.hpp"

namespace llmt {
namespace {

// Prices are the variance of the output times 2^(-k / 4), k = 0, 1, ...
constexpr std::size_t prices = 121;
constexpr double prices_per_octave = 4.0;

// Splits are searched on a sample of about this many rows; equations and errors are of all rows.
constexpr Eigen::Index growth_rows = 10000;

// Inputs of the local models with which splits are searched: the time grows with the square of their number.
constexpr Eigen::Index most_growth_inputs = 13;

// Share of the work that is left in a walk for the trees of one form. Later forms have fewer inputs.
constexpr double share_of_tree = 0.15;

// Rows in a leaf, where the caller says nothing.
constexpr Eigen::Index usual_leaf_rows = 5;

// Leaves before pruning, where the caller says nothing.
constexpr Eigen::Index most_leaves = 200;

bool contains(const std::vector<int>& inputs, int input) { return std::ranges::binary_search(inputs, input); }

std::vector<int> common(const std::vector<int>& columns, const std::vector<int>& inputs) {
  std::vector<int> result;
  std::ranges::copy_if(columns, std::back_inserter(result), [&](int column) { return contains(inputs, column); });
  return result;
}

std::vector<Node> grow(const Sample& sample, const TreePlan& plan, const WalkStep& step) {
  Table table = *sample.described.table;
  table.regression_inputs = common(table.regression_inputs, step.growth_inputs);
  table.products.clear();
  const TrainingRows rows = subsample(training_rows(table, sample.described.rows, plan.max_threads), growth_rows);
  GrowthProblem problem{
      .training = &rows, .outputs = sample.outputs, .options = plan.growth, .max_threads = plan.max_threads};
  GrowthOptions& options = problem.options;
  options.split_inputs = common(table.split_inputs, step.inputs);
  if (options.split_inputs.empty()) return std::vector<Node>(1);
  const Eigen::Index coefficients = std::ssize(rows.regressors) + 1;
  if (options.min_leaf_samples == 0) options.min_leaf_samples = std::max(usual_leaf_rows, coefficients);
  if (options.max_leaves == 0) options.max_leaves = most_leaves;
  return rule_of(GrowthRule::rd).grow(problem).nodes;
}

std::vector<int> usable_inputs(const Sample& sample) {
  const Table& table = *sample.described.table;
  std::vector<int> inputs = table.regression_inputs;
  inputs.insert(inputs.end(), table.split_inputs.begin(), table.split_inputs.end());
  std::ranges::sort(inputs);
  inputs.erase(std::unique(inputs.begin(), inputs.end()), inputs.end());
  return inputs;
}

EquationTree with_terms(const Sample& sample, std::vector<Node> grown, const std::vector<int>& inputs,
                        const Form& form) {
  const std::vector<int> of_terms = common(sample.described.table->regression_inputs, inputs);
  // A product has the slope of one factor depend on the other: no trend is kept so.
  const bool products =
      form.products && std::ssize(of_terms) <= most_inputs_of_products && sample.described.table->slope_signs.empty();
  return {sample, std::move(grown), terms_of(sample, of_terms, products), form.coarseness};
}

Eigen::VectorXd importance_of(EquationTree& tree) { return tree.importance(tree.pruned(tree.schwarz_price())); }

std::vector<JudgedTree> judge(EquationTree& tree) {
  std::vector<JudgedTree> judged;
  std::vector<int> before;
  for (std::size_t price = 0; price < prices; ++price) {
    std::vector<int> pruned = tree.pruned(price_of(tree, price));
    judged.push_back(pruned == before ? judged.back() : JudgedTree{tree.held_out_error(pruned), tree.extent(pruned)});
    before = std::move(pruned);
  }
  return judged;
}

}  // namespace

const std::vector<Form>& forms() {
  static const std::vector<Form> all = {{false, 1.0}, {false, 0.1},        {true, 1.0},
                                        {true, 0.1},  {false, 1.0, false}, {false, 0.1, false}};
  return all;
}

double price_of(const EquationTree& tree, std::size_t price) {
  return tree.variance() * std::exp2(-static_cast<double>(price) / prices_per_octave);
}

EquationTree make_tree(const Sample& sample, const TreePlan& plan, const WalkStep& step, const Form& form) {
  return with_terms(sample, form.splits ? grow(sample, plan, step) : std::vector<Node>(1), step.inputs, form);
}

std::vector<WalkStep> walk_inputs(const Sample& sample, const TreePlan& plan, Work& work) {
  std::vector<WalkStep> steps;
  std::vector<int> inputs = usable_inputs(sample);
  EquationTree equation = with_terms(sample, std::vector<Node>(1), inputs, forms().front());
  Eigen::VectorXd importance = importance_of(equation);
  while (true) {
    const Eigen::Index count = std::ssize(inputs);
    WalkStep& step = steps.emplace_back(
        WalkStep{inputs, most_important(inputs, importance, std::min(count, most_growth_inputs)), {}});
    const std::vector<Node> grown = grow(sample, plan, step);
    for (const Form& form : forms()) {
      EquationTree tree = with_terms(sample, form.splits ? grown : std::vector<Node>(1), inputs, form);
      step.trees.push_back(judge(tree));
      if (form.splits) importance = importance_of(tree);
      work.did(share_of_tree * work.left());
    }
    if (count == 1) return steps;
    inputs = most_important(inputs, importance, fewer_inputs(count));
  }
}

}  // namespace llmt
