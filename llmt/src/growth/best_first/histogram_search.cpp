#include <algorithm>
#include <limits>
#include <numeric>

#include "base/parallel.hpp"
#include "growth/best_first/histogram.hpp"

namespace llmt {
namespace {

constexpr double none = std::numeric_limits<double>::infinity();

// Looking into bins costs several times per row what the histogram costs: they may hold this part of the rows.
constexpr Eigen::Index searched_part = 2;

}  // namespace

BinnedRows::Edges BinnedRows::search_edges(const Histogram& histogram, std::size_t input, double node_rss) const {
  const std::span<const double> of_bin = grams(histogram, input);
  const std::span<const Eigen::Index> rows = counts(histogram, input);
  const Eigen::Index smallest_leaf = data_.problem.options.min_leaf_samples;
  const Eigen::Index size = shape_.size();
  Edges edges;
  if (data_.num_levels[input] > 0) {
    edges.best = search_level_grams(shape_, data_.output_weights, node_rss, 0.0, of_bin, rows, smallest_leaf);
    return edges;
  }
  Eigen::Index all = 0;
  for (std::size_t bin = 0; bin < rows.size(); ++bin) {
    if (rows[bin] > 0) {
      edges.bins.push_back(bin);
      edges.rows_before.push_back(all);
      all += rows[bin];
    }
  }
  const Eigen::Index count = std::max<Eigen::Index>(0, std::ssize(edges.bins) - 1);
  const auto sums = [&](bool from_left, std::vector<double>& side, std::vector<double>& rss, std::vector<int>& rank) {
    side.assign(count * size, 0.0);
    rss.resize(count);
    rank.resize(count);
    std::vector<const double*> at(count);
    const double* before = nullptr;
    for (Eigen::Index step = 0; step < count; ++step) {
      const Eigen::Index edge = from_left ? step : count - 1 - step;
      double* const gram = side.data() + edge * size;
      if (before != nullptr) {
        std::copy(before, before + size, gram);
      }
      add(shape_, of_bin.data() + edges.bins[from_left ? edge : edge + 1] * size, gram);
      before = at[edge] = gram;
    }
    ResidualSums(shape_, data_.output_weights).evaluate(at.data(), count, rss.data(), rank.data());
  };
  std::vector<int> rank_left;
  std::vector<int> rank_right;
  sums(true, edges.grams_left, edges.rss_left, rank_left);
  sums(false, edges.grams_right, edges.rss_right, rank_right);
  SplitCandidate& best = edges.best;
  edges.bounds.assign(edges.bins.size(), none);
  for (std::size_t k = 0; k < edges.bins.size(); ++k) {
    const std::size_t bin = edges.bins[k];
    const Eigen::Index before = edges.rows_before[k];
    const Eigen::Index left = before + rows[bin];
    const bool last = static_cast<Eigen::Index>(k) == count;
    if (inputs_.bins[input].splittable[bin] &&
        std::max(before + 1, smallest_leaf) <= std::min(left - 1, all - smallest_leaf)) {
      edges.bounds[k] = (k > 0 ? edges.rss_left[k - 1] : 0.0) + (last ? 0.0 : edges.rss_right[k]);
    }
    if (last || left < smallest_leaf || all - left < smallest_leaf) continue;
    const double rss = edges.rss_left[k] + edges.rss_right[k];
    ++best.tested;
    if (best.input < 0 || rss < best.rss - tie_tolerance * node_rss) {
      best.input = static_cast<int>(input);
      best.left = left;
      best.rss = rss;
      best.rank_left = rank_left[k];
      best.rank_right = rank_right[k];
      best.bin = static_cast<int>(bin);
      best.last_left = none;
    }
  }
  best.evaluations = best.tested;
  return edges;
}

// Exact search in the chosen bins of an input, given by their positions among those with rows.
SplitCandidate BinnedRows::look_into(const Edges& edges, const std::vector<std::size_t>& chosen, std::size_t input,
                                     const std::vector<int>& rows, double node_rss, double limit) const {
  std::vector<int> slot_of_bin(most_bins, -1);
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    slot_of_bin[edges.bins[chosen[k]]] = static_cast<int>(k);
  }
  std::vector<std::vector<int>> held(chosen.size());
  for (const int row : rows) {
    if (const int slot = slot_of_bin[inputs_.code(row, input)]; slot >= 0) {
      held[slot].push_back(row);
    }
  }
  const std::vector<double> nothing(shape_.size(), 0.0);
  SplitCandidate best;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const std::size_t at = chosen[k];
    const bool last = at + 1 == edges.bins.size();
    std::vector<std::pair<double, int>> sorted;
    for (const int row : held[k]) {
      sorted.emplace_back(data_.split_value(row, input), row);
    }
    std::ranges::sort(sorted);
    std::vector<double> values;
    std::vector<int> order;
    for (const auto& [value, row] : sorted) {
      values.push_back(value);
      order.push_back(row);
    }
    const InputSearch::Beyond front{
        edges.rows_before[at],
        at > 0 ? edges.grams_left.data() + static_cast<Eigen::Index>(at - 1) * shape_.size() : nothing.data(),
        at > 0 ? edges.rss_left[at - 1] : 0.0};
    const InputSearch::Beyond behind{
        std::ssize(rows) - front.rows - std::ssize(order),
        last ? nothing.data() : edges.grams_right.data() + static_cast<Eigen::Index>(at) * shape_.size(),
        last ? 0.0 : edges.rss_right[at]};
    InputSearch search({features(), data_.output_weights, node_rss}, values, order,
                       data_.problem.options.min_leaf_samples, front, behind);
    search.refine(limit);
    SplitCandidate found = search.best();
    best.tested += found.tested;
    best.evaluations += found.evaluations;
    if (found.input >= 0 && (best.input < 0 || found.rss < best.rss - tie_tolerance * node_rss)) {
      found.tested = best.tested;
      found.evaluations = best.evaluations;
      found.input = static_cast<int>(input);
      found.bin = static_cast<int>(edges.bins[at]);
      found.last_left = values[found.left - front.rows - 1];
      best = found;
    }
  }
  return best;
}

SplitCandidate BinnedRows::search(const Histogram& histogram, const std::vector<int>& rows, double node_rss, int rank,
                                  double& excess) const {
  const std::size_t inputs = inputs_.bins.size();
  const int threads = data_.threads_for(num_bins() * shape_.size() / 4);
  std::vector<Edges> edges(inputs);
  parallel_for(std::ssize(edges), threads, [&](Eigen::Index j) {
    edges[static_cast<std::size_t>(j)] = search_edges(histogram, static_cast<std::size_t>(j), node_rss);
  });
  double smallest = none;
  for (const Edges& input : edges) {
    smallest = input.best.input >= 0 || !input.best.level_side.empty() ? std::min(smallest, input.best.rss) : smallest;
  }
  Eigen::Index compared = 0;
  for (const Edges& input : edges) {
    compared += input.best.tested;
  }
  const double limit = data_.significant_rss(total(histogram)[0], rank, node_rss, compared);
  smallest = std::min(smallest, limit);
  // Bins that may hold a better split, the lowest bound first.
  struct Bin {
    double bound;
    std::size_t input;
    std::size_t position;
  };
  std::vector<Bin> promising;
  const double tolerance = 2.0 * tie_tolerance * node_rss;
  for (std::size_t j = 0; j < inputs; ++j) {
    for (std::size_t k = 0; k < edges[j].bounds.size(); ++k) {
      if (edges[j].bounds[k] <= smallest + tolerance) {
        promising.push_back({edges[j].bounds[k], j, k});
      }
    }
  }
  std::ranges::stable_sort(promising, [](const Bin& a, const Bin& b) { return a.bound < b.bound; });
  std::vector<std::vector<std::size_t>> chosen(inputs);
  Eigen::Index searched = 0;
  std::size_t next = 0;
  for (; next < promising.size(); ++next) {
    const Edges& of_input = edges[promising[next].input];
    const std::size_t position = promising[next].position;
    const Eigen::Index end =
        position + 1 < of_input.bins.size() ? of_input.rows_before[position + 1] : std::ssize(rows);
    searched += end - of_input.rows_before[position];
    if (searched > std::ssize(rows) / searched_part && next > 1) break;
    chosen[promising[next].input].push_back(position);
  }
  std::vector<SplitCandidate> inside(inputs);
  parallel_for(std::ssize(inside), data_.threads_for(searched * 8), [&](Eigen::Index j) {
    const std::size_t input = j;
    if (!chosen[input].empty()) {
      inside[input] = look_into(edges[input], chosen[input], input, rows, node_rss, smallest);
    }
  });
  SplitCandidate best;
  Eigen::Index tested = 0;
  Eigen::Index evaluations = 0;
  for (std::size_t j = 0; j < inputs; ++j) {
    for (SplitCandidate* candidate : {&edges[j].best, &inside[j]}) {
      tested += candidate->tested;
      evaluations += candidate->evaluations;
      const bool is_better = best.input < 0 || candidate->rss < best.rss - tie_tolerance * node_rss;
      // Equally good on the same input: the smaller threshold.
      const bool is_before = best.input == static_cast<int>(j) && candidate->left < best.left &&
                             candidate->rss <= best.rss + tie_tolerance * node_rss;
      if (candidate->input >= 0 && (is_better || is_before)) {
        best = *candidate;
        best.input = static_cast<int>(j);
      }
    }
  }
  best.tested = tested;
  best.evaluations = evaluations;
  excess = best.input >= 0 && best.rss <= limit && next < promising.size()
               ? std::max(0.0, best.rss - promising[next].bound)
               : 0.0;
  return best;
}

}  // namespace llmt
