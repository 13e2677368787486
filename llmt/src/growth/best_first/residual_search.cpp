#include "growth/best_first/residual_search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/sum_over.hpp"

namespace llmt {
namespace {

// Deviates whose relative difference is smaller count as equal, so that rounding does not choose between inputs.
constexpr double tie_of_deviates = 1e-9;

// Thresholds are rounded to this part of the input's range in the node, so that a threshold on a value of the data, as
// on grids, does not send its rows left or right by rounding.
constexpr double grid = 0x1p-32;

// If a split does not pass the F test at this level, or at GrowthOptions::significance if that is lower, the next input
// is tried.
constexpr double usual_significance = 0.05;

struct ResidualCut {
  Eigen::Index input;
  double threshold;
  double deviate;
};

// The threshold (m+ + m-) / 2 of R.2, on a grid of the node's range.
double threshold_of(const ResidualStatistics& statistics) {
  const double range = statistics.high - statistics.low;
  const double middle =
      statistics.positive_mean + 0.5 * (statistics.negative_mean - statistics.positive_mean) - statistics.low;
  return statistics.low + std::round(middle / range / grid) * grid * range;
}

// Position of the candidate with the largest deviate; of equal ones the first.
Eigen::Index next_candidate(const std::vector<ResidualCut>& candidates) {
  double largest = 0.0;
  for (const ResidualCut& candidate : candidates) {
    largest = std::max(largest, candidate.deviate);
  }
  const auto is_largest = [&](const ResidualCut& candidate) {
    return candidate.deviate >= (1.0 - tie_of_deviates) * largest;
  };
  return std::ranges::find_if(candidates, is_largest) - candidates.begin();
}

// Fills in the sums of squares of the two child models.
void evaluate(const ResidualNode& node, ResidualSplit& split) {
  const Features& features = node.search.features;
  const GramShape shape(features);
  const std::size_t small = split.sides[0].size() <= split.sides[1].size() ? 0 : 1;
  for (const std::size_t side : {small, 1 - small}) {
    if (side != small && !node.gram.empty()) {
      split.grams[side].resize(node.gram.size());
      std::transform(node.gram.begin(), node.gram.end(), split.grams[small].begin(), split.grams[side].begin(),
                     std::minus());
      continue;
    }
    std::vector<int> rows;
    rows.reserve(split.sides[side].size());
    for (const int position : split.sides[side]) {
      rows.push_back(node.rows[position]);
    }
    split.grams[side] = sum_gram(features, rows, node.threads);
  }
  std::vector<double> both = split.grams[0];
  add(shape, split.grams[1].data(), both.data());
  const std::array<const double*, 3> grams = {split.grams[0].data(), split.grams[1].data(), both.data()};
  std::array<double, 3> rss{};
  std::array<int, 3> rank{};
  ResidualSums(shape, node.search.weights).evaluate(grams.data(), 3, rss.data(), rank.data());
  const bool has_missing = split.sides[0].size() + split.sides[1].size() < node.rows.size();
  split.best.rss = rss[0] + rss[1] + (has_missing ? node.search.rss - rss[2] : 0.0);
  split.best.rank_left = rank[0];
  split.best.rank_right = rank[1];
  const AdjustedRss scale = node.search.scale();
  split.best.adjusted = scale.of(split.best.rss, scale.counted(rank[0], std::ssize(split.sides[0])) +
                                                     scale.counted(rank[1], std::ssize(split.sides[1])));
}

std::span<const double> values_of(const ResidualNode& node, Eigen::Index split_input) {
  return std::span(node.values.col(split_input).data(), node.rows.size());
}

// The cut of each numeric input for each output, if the test of its classes says anything.
std::vector<ResidualCut> candidates_of(const GrowthData& data, const ResidualNode& node) {
  const Eigen::Index outputs = node.residuals.cols();
  std::vector<ResidualStatistics> statistics(data.split_inputs() * outputs);
  parallel_for(std::ssize(statistics), node.threads, [&](Eigen::Index k) {
    if (data.num_levels[k / outputs] > 0) return;
    data.problem.check(std::ssize(node.rows));
    const std::span residuals(node.residuals.col(k % outputs).data(), node.rows.size());
    statistics[k] =
        residual_statistics(values_of(node, k / outputs), residuals, std::span(node.weights.data(), node.rows.size()));
  });
  std::vector<ResidualCut> candidates;
  for (Eigen::Index k = 0; k < std::ssize(statistics); ++k) {
    const double deviate = statistics[k].deviate();
    if (deviate > 0.0) candidates.push_back({k / outputs, threshold_of(statistics[k]), deviate});
  }
  return candidates;
}

// The split at a candidate's threshold, without the models of its sides.
ResidualSplit divide(const ResidualNode& node, const ResidualCut& candidate) {
  ResidualSplit split;
  const std::span<const double> values = values_of(node, candidate.input);
  for (int i = 0; i < std::ssize(values); ++i) {
    if (!std::isnan(values[i])) split.sides[values[i] <= candidate.threshold ? 0 : 1].push_back(i);
  }
  split.best.input = static_cast<int>(candidate.input);
  split.best.left = std::ssize(split.sides[0]);
  split.best.last_left = candidate.threshold;
  return split;
}

}  // namespace

std::vector<double> sum_gram(const Features& features, std::span<const int> rows, int threads) {
  const auto add = [&](RowSpan block, std::vector<double>& gram) {
    add_rows(features, rows.data() + block.begin, block.count(), gram.data());
  };
  return sum_over(RowBlocks{std::ssize(rows)}, threads, std::vector<double>(GramShape(features).size(), 0.0), add);
}

ResidualSplit search_by_residuals(const GrowthData& data, const ResidualNode& node) {
  std::vector<ResidualCut> candidates = candidates_of(data, node);
  const Eigen::Index tested = std::ssize(candidates);
  const Eigen::Index smallest_leaf = std::max<Eigen::Index>(data.problem.options.min_leaf_samples, 1);
  const double level = std::min(data.problem.options.significance, usual_significance);
  const auto passes = [&](const SplitCandidate& split) {
    return split.input >= 0 && data.is_significant(level, node.search.weight, node.search.rank, node.search.rss,
                                                   {split.rank_left, split.rank_right}, split.rss, tested);
  };
  ResidualSplit best;
  Eigen::Index evaluations = 0;
  while (!candidates.empty() && !passes(best.best)) {
    const auto next = candidates.begin() + next_candidate(candidates);
    ResidualSplit split = divide(node, *next);
    candidates.erase(next);
    if (std::min(std::ssize(split.sides[0]), std::ssize(split.sides[1])) < smallest_leaf) continue;
    evaluate(node, split);
    ++evaluations;
    if (best.best.input < 0 || split.best.adjusted < best.best.adjusted - tie_tolerance * node.search.rss) {
      best = std::move(split);
    }
  }
  if (best.best.input >= 0) {
    best.best.tested = tested;
    best.best.evaluations = evaluations;
  }
  return best;
}

}  // namespace llmt
