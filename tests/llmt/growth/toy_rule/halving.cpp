#include "llmt/growth/toy_rule/halving.hpp"

#include <algorithm>
#include <numeric>

#include "data/dataset.hpp"
#include "numerics/node_fit.hpp"

namespace toy_rule {
namespace {

// A node and the positions of its rows, in the order of the split input.
struct Open {
  int node;
  std::vector<int> rows;
};

llmt::Node leaf_of(const llmt::GrowthProblem& problem, const std::vector<int>& rows) {
  const llmt::Chunk chunk = llmt::fetch(*problem.training, rows, problem.outputs);
  const llmt::NodeFit fit = llmt::fit_node(chunk.deviations, chunk.outputs, chunk.weights);
  return {.samples = chunk.count(),
          .rank = fit.rank,
          .rss = fit.rss,
          .value = fit.centre_change,
          .slope = fit.slope_change,
          .mean = fit.mean,
          .low = fit.low,
          .high = fit.high};
}

}  // namespace

llmt::GrownPartition grow_halves(const llmt::GrowthProblem& problem) {
  const llmt::TrainingRows& training = *problem.training;
  const int input = problem.options.split_inputs.front();
  const auto value = [&](int position) { return training.table->inputs(training.rows[position], input); };
  std::vector<int> rows(training.rows.size());
  std::iota(rows.begin(), rows.end(), 0);
  std::ranges::stable_sort(rows, {}, value);
  llmt::GrownPartition grown{.nodes = {leaf_of(problem, rows)}, .stop = llmt::StopReason::leaf_samples};
  std::vector<Open> level = {{0, rows}};
  const Eigen::Index most = problem.options.max_leaves > 0 ? problem.options.max_leaves : 8;
  for (std::size_t next = 0; next < level.size() && (std::ssize(grown.nodes) + 1) / 2 < most; ++next) {
    const Open open = level[next];
    const auto middle = open.rows.begin() + std::ssize(open.rows) / 2;
    if (std::ssize(open.rows) / 2 < problem.options.min_leaf_samples || value(*(middle - 1)) == value(*middle))
      continue;
    const std::vector<int> left(open.rows.begin(), middle);
    const std::vector<int> right(middle, open.rows.end());
    const int first = static_cast<int>(grown.nodes.size());
    grown.nodes.push_back(leaf_of(problem, left));
    grown.nodes.push_back(leaf_of(problem, right));
    llmt::Node& node = grown.nodes[open.node];
    node.left = first;
    node.right = first + 1;
    node.split_input = input;
    node.threshold = 0.5 * (value(left.back()) + value(right.front()));
    level.push_back({first, left});
    level.push_back({first + 1, right});
  }
  return grown;
}

}  // namespace toy_rule
