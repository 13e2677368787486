#include "growth/best_first/exact_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/parallel.hpp"
#include "growth/best_first/residual_search.hpp"

namespace llmt {
namespace {

SplitCandidate search_categories(const GrowthData& data, const ExactLeaf& leaf, const SearchNode& node,
                                 Eigen::Index split_input) {
  return search_levels(node, levels_in(data, leaf, split_input), data.num_levels[split_input],
                       data.problem.options.min_leaf_samples);
}

// Takes the split into rows with and without a value if it is better: it can be informative that a value is missing.
void consider_missing(const GrowthData& data, const ExactLeaf& leaf, const SearchNode& node, Eigen::Index split_input,
                      SplitCandidate& best) {
  std::vector<int> is_missing;
  for (Eigen::Index row = 0; row < leaf.inputs.rows(); ++row) {
    is_missing.push_back(std::isnan(leaf.split_value(data, row, split_input)) ? 1 : 0);
  }
  SplitCandidate candidate = search_levels(node, is_missing, 2, data.problem.options.min_leaf_samples);
  const Eigen::Index tested = best.tested + candidate.tested;
  if (candidate.input >= 0 && (best.input < 0 || candidate.adjusted < best.adjusted - tie_tolerance * node.rss)) {
    best = std::move(candidate);
    best.level_side.clear();
    best.by_missing = true;
  }
  best.tested = tested;
}

// Most doubles (256 MiB) that the sums of all inputs may take between the two steps of the search.
constexpr Eigen::Index most_kept_sums = Eigen::Index{1} << 25;

// The search along one numeric input, with the edges of its blocks searched.
InputSearch search_blocks(const GrowthData& data, const ExactLeaf& leaf, const SearchNode& node,
                          Eigen::Index split_input) {
  const std::vector<int>& order = leaf.orders[split_input];
  std::vector<double> values(order.size());
  std::ranges::transform(order, values.begin(), [&](int row) { return leaf.split_value(data, row, split_input); });
  InputSearch search(node, std::move(values), order, data.problem.options.min_leaf_samples);
  search.search_edges();
  return search;
}

SplitCandidate compare_all_thresholds(const GrowthData& data, const ExactLeaf& leaf, const SearchNode& node) {
  const Eigen::Index inputs = std::ssize(leaf.orders);
  const int threads = data.threads_for(leaf.inputs.rows() * data.split_inputs());
  std::vector<std::optional<InputSearch>> searches(inputs);
  std::vector<SplitCandidate> found(inputs);
  const GramShape shape(node.features);
  const bool forget = InputSearch::size_of_sums(shape, leaf.inputs.rows()) > most_kept_sums / inputs;
  parallel_for(inputs, threads, [&](Eigen::Index j) {
    data.problem.check(leaf.inputs.rows());
    if (data.num_levels[j] > 0) {
      found[j] = search_categories(data, leaf, node, j);
    } else {
      searches[j].emplace(search_blocks(data, leaf, node, j));
      if (forget) searches[j]->forget_sums();
    }
  });
  // The smallest adjusted RSS that any input has found bounds the search of all. It is taken after all edges are known,
  // so that it does not depend on the order in which threads finish.
  double limit = std::numeric_limits<double>::infinity();
  Eigen::Index tested = 0;
  for (const std::optional<InputSearch>& search : searches) {
    if (!search) continue;
    limit = std::min(limit, search->smallest());
    tested += search->tested();
  }
  limit = std::min(limit, data.significant_rss(node.weight, node.rank, node.rss, tested));
  parallel_for(inputs, threads, [&](Eigen::Index j) {
    if (!searches[j]) return;
    data.problem.check(leaf.inputs.rows());
    searches[j]->refine(limit);
    found[j] = searches[j]->best();
    if (std::ssize(leaf.orders[j]) < leaf.inputs.rows()) consider_missing(data, leaf, node, j, found[j]);
    searches[j].reset();
  });
  return first_of_best(found, node.rss);
}

SplitCandidate compare_residuals(const GrowthData& data, const ExactLeaf& leaf, const SearchNode& node) {
  std::vector<int> rows(leaf.inputs.rows());
  std::iota(rows.begin(), rows.end(), 0);
  const int threads = data.threads_for(leaf.inputs.rows() * data.split_inputs());
  const Eigen::MatrixXd values = leaf.inputs(Eigen::all, data.problem.options.split_inputs);
  ResidualSplit numeric = search_by_residuals(data, {node, rows, values, leaf.residuals, leaf.weights, {}, threads});
  std::vector<SplitCandidate> found(leaf.orders.size());
  parallel_for(std::ssize(found), threads, [&](Eigen::Index j) {
    if (numeric.best.input == j) found[j] = std::move(numeric.best);
    if (data.num_levels[j] > 0) {
      found[j] = search_categories(data, leaf, node, j);
    } else if (values.col(j).hasNaN()) {
      consider_missing(data, leaf, node, j, found[j]);
    }
  });
  return first_of_best(found, node.rss);
}

}  // namespace

SplitCandidate find_split(const GrowthData& data, const ExactLeaf& leaf, const NodeFit& fit, double rss) {
  if (leaf.inputs.rows() < 2 * data.problem.options.min_leaf_samples) return {};
  const SearchNode node{fit.features, data.output_weights, rss, leaf.weights.sum(), fit.rank};
  if (data.problem.criterion == SplitCriterion::residual_signs) return compare_residuals(data, leaf, node);
  return compare_all_thresholds(data, leaf, node);
}

}  // namespace llmt
