#include "boosted/one_tree.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "boosted/leaf_model.hpp"
#include "boosted/linear_start.hpp"
#include "boosted/model/boosted_checks.hpp"
#include "fit/pipeline.hpp"
#include "fit/prepare.hpp"

namespace llmt {
namespace {

FitOptions options_of(GrowthRule rule, int max_threads) {
  FitOptions options;
  options.rule = rule;
  options.max_leaves = 24;
  options.max_threads = max_threads;
  return options;
}

// A sum has no split that sends several levels to one side, and the means of its leaves are only for what no row lacks.
bool may_have_tree(const BoostingData& data) {
  return !data.regime.rules_of_tree.empty() && !data.x.hasNaN() &&
         std::ranges::none_of(data.inputs, &InputColumn::is_categorical);
}

bool is_sayable(const Model& model) {
  const ValidityKind kind = model.partitions().front().validity.kind;
  const bool has_products =
      std::ranges::any_of(model.regressors(), [](const Regressor& regressor) { return regressor.second_input >= 0; });
  return !has_products && (kind == ValidityKind::crisp || kind == ValidityKind::blend);
}

// A node's model in the features of a sum: input j is the feature j, z = (x - centre) / deviation.
BoostedLeaf leaf_of(const Node& node, const std::vector<Regressor>& regressors, const BoostingData& data) {
  BoostedLeaf leaf{.constant = node.value(0)};
  for (Eigen::Index k = 0; k < node.slope.cols(); ++k) {
    const double slope = node.slope(0, k);
    if (slope == 0.0) continue;
    const int input = regressors[k].input;
    leaf.constant += slope * (data.inputs[input].centre - regressors[k].centre);
    leaf.features.push_back(input);
    leaf.slopes.push_back(slope * data.deviations[input]);
    const double mean = regressors[k].centre + node.mean(k) - data.inputs[input].centre;
    leaf.means.push_back(rounded_stand_in(mean / data.deviations[input]));
  }
  return leaf;
}

BoostedSplit split_of(const Node& node, const BoostingData& data) {
  const double deviation = data.deviations[node.split_input];
  return {.feature = node.split_input,
          .threshold = (node.threshold - data.inputs[node.split_input].centre) / deviation,
          .half_width = node.half_width / deviation,
          .missing_left = rounded_stand_in(node.missing_left)};
}

double value_at(const BoostedLeaf& leaf, const BinnedRows& rows, int row) {
  double value = leaf.constant;
  for (std::size_t k = 0; k < leaf.features.size(); ++k) {
    value += leaf.slopes[k] * rows.features[leaf.features[k]].value(row);
  }
  return value;
}

// `validities`: of the leaf in the rows `train`.
void hold(BoostedLeaf& leaf, const Eigen::VectorXd& validities, const BinnedRows& rows, const std::vector<int>& train) {
  leaf.low = std::numeric_limits<double>::infinity();
  leaf.high = -leaf.low;
  for (Eigen::Index i = 0; i < validities.size(); ++i) {
    if (validities(i) <= 0.0) continue;
    const double value = value_at(leaf, rows, train[i]);
    leaf.low = std::min(leaf.low, value);
    leaf.high = std::max(leaf.high, value);
  }
  if (leaf.low > leaf.high) leaf.low = leaf.high = leaf.constant;
  const double margin = 0.1 * (leaf.high - leaf.low);
  leaf.low -= margin;
  leaf.high += margin;
}

// `train`: the rows that the model was fitted to.
std::optional<BoostedTree> translated(const Model& model, const BoostingData& data, const std::vector<int>& train,
                                      int max_threads) {
  if (!is_sayable(model)) return std::nullopt;
  const std::vector<Node>& nodes = model.partitions().front().nodes;
  const Eigen::MatrixXd validities = model.validities(data.x(train, Eigen::all), 0, max_threads);
  BoostedTree tree;
  tree.smallest_share = 0.0;  // blends hand over smoothly down to nothing
  std::vector<int> number(nodes.size(), 0);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (nodes[k].is_leaf()) continue;
    number[k] = static_cast<int>(tree.splits.size());
    tree.splits.push_back(split_of(nodes[k], data));
  }
  for (const Leaf& leaf : model.leaves(0)) {
    number[leaf.node] = -1 - static_cast<int>(tree.leaves.size());
    tree.leaves.push_back(leaf_of(nodes[leaf.node], model.regressors(), data));
    if (std::ssize(tree.leaves.back().slopes) > most_leaf_slopes) return std::nullopt;
    hold(tree.leaves.back(), validities.col(std::ssize(tree.leaves) - 1), data.rows, train);
  }
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (nodes[k].is_leaf()) continue;
    tree.splits[number[k]].left = number[nodes[k].left];
    tree.splits[number[k]].right = number[nodes[k].right];
  }
  return tree;
}

// The rows for the preparation of a fit.
GivenRows rows_of(const BoostingData& data, const Eigen::VectorXd& output) {
  return {.inputs = {data.x}, .outputs = {output}, .weights = data.rows.weights, .may_have_codes = false};
}

FitResult fit_tree(const GivenRows& rows, const FitOptions& options, Work& work) {
  return fit(prepare(rows, options, work), work);
}

// A fit with what another one of the same inputs chose, and nothing more to choose.
FitOptions chosen_options(const FitOptions& compared, const FitSummary& summary, Eigen::Index inputs) {
  const PartitionSummary& partition = summary.partitions.front();
  const Candidate& chosen = partition.chosen.candidate;
  FitOptions options = compared;
  options.max_leaves = chosen.leaves;
  // As where blends are candidates, which they were.
  options.min_leaf_samples = std::max<Eigen::Index>(5, inputs - std::ssize(partition.left_out));
  options.significance = 1.0;  // the number of leaves is known
  options.choose_inputs = false;
  options.validity = chosen.validity.kind == ValidityKind::crisp ? ValidityChoice::crisp : ValidityChoice::blend;
  options.folds.count = 0;
  options.expert.estimation = chosen.estimation;
  options.expert.shrinkages = {chosen.shrinkage};
  if (chosen.validity.kind == ValidityKind::blend) {
    options.expert.widths = {chosen.validity.width};
    options.expert.jumps = {chosen.jump};
    options.expert.ridges = {chosen.ridge};
  }
  if (partition.left_out.empty()) return options;
  for (int input = 0; input < inputs; ++input) {
    if (std::ranges::count(partition.left_out, input) == 0) options.split_inputs.push_back(input);
  }
  options.regression_inputs = options.split_inputs;
  return options;
}

// The residuals of the rows that the model was not fitted to.
std::optional<Eigen::VectorXd> residuals_of(const Model& model, const BoostingData& data, const Eigen::VectorXd& output,
                                            const HoldOut& rows, int max_threads) {
  const std::optional<BoostedTree> tree = translated(model, data, rows.train, max_threads);
  if (!tree) return std::nullopt;
  return (output - values_of({*tree}, data.rows))(rows.held_out);
}

}  // namespace

std::optional<OneTree> one_tree(const BoostingData& data, const Eigen::VectorXd& output, int max_threads, Work& work) {
  if (!may_have_tree(data)) return std::nullopt;
  GivenRows rows_in_folds = rows_of(data, output);
  rows_in_folds.groups.assign(data.parts.begin(), data.parts.end());
  const FitOptions options = options_of(data.regime.rules_of_tree.front(), max_threads);
  const FitResult fitted = fit_tree(rows_in_folds, options, work);
  const std::optional<BoostedTree> tree = translated(fitted.model, data, all_rows(output.size()), max_threads);
  if (!tree) return std::nullopt;
  OneTree result{.tree = *tree, .residuals = output};
  for (std::size_t fold = 0; fold < fitted.intervals.models().size(); ++fold) {
    const HoldOut rows = part_apart(data.parts, data.parts[fitted.summary.held_out[fold].front()]);
    const auto residuals = residuals_of(fitted.intervals.models()[fold], data, output, rows, max_threads);
    if (!residuals) return std::nullopt;
    result.residuals(rows.held_out) = *residuals;
  }
  return result;
}

std::optional<TriedTree> try_tree(const BoostingData& data, const Eigen::VectorXd& output, const HoldOut& rows,
                                  std::span<const GrowthRule> rules, int max_threads, Work& work) {
  if (!may_have_tree(data)) return std::nullopt;
  GivenRows divided = rows_of(data, output);
  divided.held_out.resize(output.size(), false);
  for (const int row : rows.held_out) divided.held_out[row] = true;
  const Eigen::VectorXd weights = data.rows.weights(rows.held_out);
  std::optional<TriedTree> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < rules.size(); ++k) {
    Work part(work, work.left() / static_cast<double>(rules.size() - k));
    const FitOptions options = options_of(rules[k], max_threads);
    const FitResult fitted = fit_tree(divided, options, part);
    const auto residuals = residuals_of(fitted.model, data, output, rows, max_threads);
    if (!residuals) continue;
    const double squares = residuals->cwiseAbs2().dot(weights);
    if (squares >= least) continue;
    least = squares;
    best = TriedTree{*residuals, chosen_options(options, fitted.summary, data.x.cols())};
  }
  return best;
}

std::optional<BoostedTree> tree_of_all(const BoostingData& data, const Eigen::VectorXd& output, const TriedTree& tried,
                                       Work& work) {
  const FitResult fitted = fit_tree(rows_of(data, output), tried.options, work);
  return translated(fitted.model, data, all_rows(output.size()), tried.options.max_threads);
}

std::optional<Eigen::VectorXd> residuals_without(const BoostingData& data, const Eigen::VectorXd& output,
                                                 const HoldOut& rows, const FitOptions& options, Work& work) {
  const FitResult fitted =
      fit_tree(rows_at(rows_of(data, output), {rows.train.begin(), rows.train.end()}), options, work);
  return residuals_of(fitted.model, data, output, rows, options.max_threads);
}

SumPart part_of(const BoostedTree& tree, const Eigen::VectorXd& output, const BinnedRows& rows) {
  SumPart part{.rounds = {}, .start = {tree}};
  part.rounds.residuals = output - values_of(part.start, rows);
  return part;
}

}  // namespace llmt
