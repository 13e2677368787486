#include "growth/best_first/residual_search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "base/parallel.hpp"

namespace llmt {
namespace {

// Deviates that agree to this part are equal: rounding does not choose between inputs.
constexpr double tie_of_deviates = 1e-9;

// Thresholds are rounded to this part of the input's range in the node, so that a threshold on a value of the data, as
// on grids, does not send its rows left or right by rounding.
constexpr double grid = 0x1p-32;

// A split that does not pass the F test at this level, or at that asked for, makes the next input worth a try.
constexpr double usual_significance = 0.05;

constexpr Eigen::Index partial_sums = 16;
constexpr Eigen::Index rows_of_a_sum = 4096;

struct Cut {
  Eigen::Index input;
  double threshold;
  double deviate;
};

// (m+ + m-) / 2 on a grid of the node's range.
double threshold_of(const ResidualStatistics& statistics) {
  const double range = statistics.high - statistics.low;
  const double middle =
      statistics.positive_mean + 0.5 * (statistics.negative_mean - statistics.positive_mean) - statistics.low;
  return statistics.low + std::round(middle / range / grid) * grid * range;
}

// The first of those that are about the most significant.
std::size_t next_candidate(const std::vector<Cut>& candidates) {
  double largest = 0.0;
  for (const Cut& candidate : candidates) {
    largest = std::max(largest, candidate.deviate);
  }
  return static_cast<std::size_t>(
      std::ranges::find_if(
          candidates, [&](const Cut& candidate) { return candidate.deviate >= (1.0 - tie_of_deviates) * largest; }) -
      candidates.begin());
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
}

}  // namespace

std::vector<double> sum_gram(const Features& features, std::span<const int> rows, int threads) {
  const GramShape shape(features);
  const Eigen::Index count = std::ssize(rows);
  const Eigen::Index parts = std::clamp<Eigen::Index>(count / rows_of_a_sum, 1, partial_sums);
  std::vector<std::vector<double>> sums(parts, std::vector<double>(shape.size(), 0.0));
  parallel_for(parts, threads, [&](Eigen::Index part) {
    const Eigen::Index begin = count * part / parts;
    add_rows(features, rows.data() + begin, count * (part + 1) / parts - begin, sums[part].data());
  });
  for (std::size_t part = 1; part < sums.size(); ++part) {
    add(shape, sums[part].data(), sums[0].data());
  }
  return std::move(sums[0]);
}

ResidualSplit search_by_residuals(const GrowthData& data, const ResidualNode& node) {
  const Eigen::Index inputs = data.split_inputs();
  const Eigen::Index outputs = node.residuals.cols();
  const Eigen::Index count = std::ssize(node.rows);
  const Eigen::Index smallest_leaf = data.problem.options.min_leaf_samples;
  const auto values_of = [&](Eigen::Index j) { return std::span(node.values.col(j).data(), count); };
  std::vector<ResidualStatistics> statistics(inputs * outputs);
  parallel_for(inputs * outputs, node.threads, [&](Eigen::Index k) {
    if (data.num_levels[k / outputs] == 0) {
      statistics[k] =
          residual_statistics(values_of(k / outputs), std::span(node.residuals.col(k % outputs).data(), count),
                              std::span(node.weights.data(), count));
    }
  });
  std::vector<Cut> candidates;
  for (Eigen::Index j = 0; j < inputs; ++j) {
    for (Eigen::Index o = 0; o < outputs; ++o) {
      const ResidualStatistics& each = statistics[j * outputs + o];
      if (each.deviate() > 0.0) {
        candidates.push_back({j, threshold_of(each), each.deviate()});
      }
    }
  }
  const Eigen::Index tested = std::ssize(candidates);
  const double level = std::min(data.problem.options.significance, usual_significance);
  const auto passes = [&](const SplitCandidate& split) {
    return split.input >= 0 && data.is_significant(level, node.weights.sum(), node.rank, node.search.rss,
                                                   {split.rank_left, split.rank_right}, split.rss, tested);
  };
  ResidualSplit best;
  Eigen::Index evaluations = 0;
  while (!candidates.empty() && !passes(best.best)) {
    const std::size_t next = next_candidate(candidates);
    const Cut candidate = candidates[next];
    candidates.erase(candidates.begin() + static_cast<Eigen::Index>(next));
    ResidualSplit split;
    const std::span<const double> values = values_of(candidate.input);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!std::isnan(values[i])) {
        split.sides[values[i] <= candidate.threshold ? 0 : 1].push_back(static_cast<int>(i));
      }
    }
    if (std::min(std::ssize(split.sides[0]), std::ssize(split.sides[1])) < std::max<Eigen::Index>(smallest_leaf, 1)) {
      continue;
    }
    split.best.input = static_cast<int>(candidate.input);
    split.best.left = std::ssize(split.sides[0]);
    split.best.last_left = candidate.threshold;
    evaluate(node, split);
    ++evaluations;
    if (best.best.input < 0 || split.best.rss < best.best.rss - tie_tolerance * node.search.rss) {
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
