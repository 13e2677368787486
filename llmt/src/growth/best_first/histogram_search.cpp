#include <algorithm>
#include <limits>

#include "base/parallel.hpp"
#include "growth/best_first/histogram.hpp"
#include "growth/search/rank_without.hpp"

namespace llmt {
namespace {

constexpr double no_edge = std::numeric_limits<double>::infinity();

// Searching a bin exactly costs several times per row what the histogram costs. So the bins that are searched exactly
// may hold at most one row in this number of rows.
constexpr Eigen::Index searched_part = 2;

}  // namespace

BinnedRows::Edges BinnedRows::search_edges(const Histogram& histogram, const std::vector<int>& node_rows,
                                           std::size_t input, const AdjustedRss& scale) const {
  const std::span<const double> of_bin = histogram[input].grams;
  const std::span<const Eigen::Index> rows = histogram[input].counts;
  const Eigen::Index smallest_leaf = data_.problem.options.min_leaf_samples;
  Edges edges;
  if (data_.num_levels[input] > 0) {
    edges.best = search_level_grams(shape_, data_.output_weights, scale, 0.0, of_bin, rows, smallest_leaf);
    return edges;
  }
  Eigen::Index all = 0;
  std::vector<const double*> grams;
  for (std::size_t bin = 0; bin < rows.size(); ++bin) {
    if (rows[bin] > 0) {
      grams.push_back(of_bin.data() + bin * shape_.size());
      edges.bins.push_back(bin);
      edges.rows_before.push_back(all);
      all += rows[bin];
    }
  }
  ResidualSums models(shape_, data_.output_weights);
  edges.sum(shape_, grams);
  edges.evaluate(models);
  for (std::vector<int>* ranks : {&edges.rank_left, &edges.rank_right}) {
    std::ranges::transform(*ranks, ranks->begin(), [&](int rank) { return scale.of_child(rank); });
  }
  edges.best = best_edge(edges, rows, node_rows, input, scale);
  bound_bins(edges, rows, input);
  return edges;
}

// True if the two rows next to an edge decide a direction of the model of their side (docs/algorithms/growth.md). They
// can only if the bin that holds them does.
bool BinnedRows::rests_on_two_rows(const Edges& edges, std::size_t at, std::size_t input,
                                   const std::vector<int>& node_rows) const {
  const auto rests = [&](std::size_t bin, int rank, int rank_beyond, const double* gram, bool is_left) {
    if (rank_beyond >= rank) return false;
    std::vector<int> next_to = rows_in_bins(edges, {bin}, input, node_rows).front();
    std::ranges::sort(next_to, [&](int a, int b) {
      const double difference = data_.split_value(a, input) - data_.split_value(b, input);
      return difference != 0.0 ? (difference > 0.0) == is_left : (a > b) == is_left;
    });
    next_to.resize(std::min<std::size_t>(next_to.size(), 2));
    ResidualSums sums(shape_, data_.output_weights);
    return rank_without(features(), gram, next_to, sums) < rank;
  };
  // The outermost bins hold rows enough for a child.
  const bool of_left =
      at > 0 && rests(at, edges.rank_left[at], edges.rank_left[at - 1], edges.left.data() + at * shape_.size(), true);
  return of_left || (at + 1 < edges.rank_right.size() && rests(at + 1, edges.rank_right[at], edges.rank_right[at + 1],
                                                               edges.right.data() + at * shape_.size(), false));
}

// The best split at an edge between two bins.
SplitCandidate BinnedRows::best_edge(const Edges& edges, std::span<const Eigen::Index> rows,
                                     const std::vector<int>& node_rows, std::size_t input,
                                     const AdjustedRss& scale) const {
  const Eigen::Index smallest_leaf = data_.problem.options.min_leaf_samples;
  const Eigen::Index all = edges.bins.empty() ? 0 : edges.rows_before.back() + rows[edges.bins.back()];
  const double tolerance = tie_tolerance * scale.of_node();
  SplitCandidate best;
  for (std::size_t k = 0; k + 1 < edges.bins.size(); ++k) {
    const Eigen::Index left = edges.rows_before[k + 1];
    if (left < smallest_leaf || all - left < smallest_leaf) continue;
    const double rss = edges.rss_left[k] + edges.rss_right[k];
    ++best.tested;
    const int ranks = scale.counted(edges.rank_left[k], left) + scale.counted(edges.rank_right[k], all - left);
    const double adjusted = scale.of(rss, ranks);
    if (best.input >= 0 && adjusted >= best.adjusted - tolerance) continue;
    if (rests_on_two_rows(edges, k, input, node_rows)) continue;
    best.input = static_cast<int>(input);
    best.left = left;
    best.rss = rss;
    best.adjusted = adjusted;
    best.rank_left = edges.rank_left[k];
    best.rank_right = edges.rank_right[k];
    best.bin = static_cast<int>(edges.bins[k]);
    best.last_left = no_edge;
  }
  best.evaluations = best.tested;
  return best;
}

// The bounds (docs/algorithms/split-search.md, S.1 and S.2) of the splits inside each bin that has rows; infinity if a
// bin has no admissible split inside. At either end, where the rows of a bin are not sorted, the rank is taken to be
// that of the whole outermost bin.
void BinnedRows::bound_bins(Edges& edges, std::span<const Eigen::Index> rows, std::size_t input) const {
  const Eigen::Index smallest_leaf = data_.problem.options.min_leaf_samples;
  const std::size_t count = edges.bins.size();
  const Eigen::Index all = count == 0 ? 0 : edges.rows_before.back() + rows[edges.bins.back()];
  edges.bounds.assign(count, no_edge);
  edges.ranks.assign(count, 0);
  for (std::size_t k = 0; k < count; ++k) {
    const Eigen::Index before = edges.rows_before[k];
    const Eigen::Index after = before + rows[edges.bins[k]];
    const Eigen::Index first = std::max(before + 1, smallest_leaf);
    const Eigen::Index last = std::min(after - 1, all - smallest_leaf);
    if (inputs_.bins[input].splittable[edges.bins[k]] && first <= last) {
      edges.bounds[k] = (k > 0 ? edges.rss_left[k - 1] : 0.0) + (k + 1 < count ? edges.rss_right[k] : 0.0);
      if (count > 1) edges.ranks[k] = edges.rank_left[k > 0 ? k - 1 : 0] + edges.rank_right[std::min(k, count - 2)];
    }
  }
}

// The chosen bins of an input, given by their positions among those with rows: the rows in each.
std::vector<std::vector<int>> BinnedRows::rows_in_bins(const Edges& edges, const std::vector<std::size_t>& chosen,
                                                       std::size_t input, const std::vector<int>& rows) const {
  std::vector<int> slot_of_bin(most_bins, -1);
  for (int k = 0; k < std::ssize(chosen); ++k) {
    slot_of_bin[edges.bins[chosen[k]]] = k;
  }
  std::vector<std::vector<int>> held(chosen.size());
  for (const int row : rows) {
    if (const int slot = slot_of_bin[inputs_.code(row, input)]; slot >= 0) held[slot].push_back(row);
  }
  return held;
}

// Exact search in the chosen bins of an input, given by their positions among those with rows.
SplitCandidate BinnedRows::look_into(const Edges& edges, const std::vector<std::size_t>& chosen, std::size_t input,
                                     const std::vector<int>& rows, const SearchNode& node, double limit) const {
  const std::vector<std::vector<int>> held = rows_in_bins(edges, chosen, input, rows);
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
    const InputSearch::Beyond front{edges.rows_before[at],
                                    at > 0 ? edges.left.data() + (at - 1) * shape_.size() : nothing.data(),
                                    at > 0 ? edges.rss_left[at - 1] : 0.0, at > 0 ? edges.rank_left[at - 1] : 0};
    const InputSearch::Beyond behind{std::ssize(rows) - front.rows - std::ssize(order),
                                     last ? nothing.data() : edges.right.data() + at * shape_.size(),
                                     last ? 0.0 : edges.rss_right[at], last ? 0 : edges.rank_right[at]};
    InputSearch search(node, values, order, data_.problem.options.min_leaf_samples, front, behind);
    search.refine(limit);
    SplitCandidate found = search.best();
    best.tested += found.tested;
    best.evaluations += found.evaluations;
    if (found.input >= 0 && (best.input < 0 || found.adjusted < best.adjusted - tie_tolerance * node.rss)) {
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

// Bins whose bound allows a split whose adjusted RSS is not above `smallest`, the lowest bound first.
std::vector<BinnedRows::PromisingBin> BinnedRows::promising_bins(const std::vector<Edges>& edges,
                                                                 const AdjustedRss& scale, double smallest) {
  // Twice the tolerance: a split within the tolerance of the best one counts as equal to it.
  const double tolerance = 2.0 * tie_tolerance * scale.of_node();
  std::vector<PromisingBin> promising;
  for (std::size_t j = 0; j < edges.size(); ++j) {
    for (std::size_t k = 0; k < edges[j].bounds.size(); ++k) {
      const double bound = scale.of(edges[j].bounds[k], edges[j].ranks[k]);
      if (bound <= smallest + tolerance) promising.push_back({bound, j, k});
    }
  }
  std::ranges::stable_sort(promising, {}, &PromisingBin::bound);
  return promising;
}

// The first promising bins, as many as hold at most half of the rows, but two at least.
BinnedRows::ChosenBins BinnedRows::choose_bins(const std::vector<PromisingBin>& promising,
                                               const std::vector<Edges>& edges, Eigen::Index rows) {
  ChosenBins chosen{std::vector<std::vector<std::size_t>>(edges.size()), 0, no_edge};
  for (std::size_t next = 0; next < promising.size(); ++next) {
    const auto& [bound, input, position] = promising[next];
    const std::vector<Eigen::Index>& rows_before = edges[input].rows_before;
    const Eigen::Index end = position + 1 < rows_before.size() ? rows_before[position + 1] : rows;
    chosen.rows += end - rows_before[position];
    if (chosen.rows > rows / searched_part && next > 1) {
      chosen.first_bound_left_out = bound;
      break;
    }
    chosen.of_input[input].push_back(position);
  }
  return chosen;
}

// The best of the splits at edges and inside bins. Of equally good ones the first input wins, then the smaller
// threshold.
SplitCandidate BinnedRows::best_of(const std::vector<Edges>& edges, const std::vector<SplitCandidate>& inside,
                                   double node_rss) {
  const double tolerance = tie_tolerance * node_rss;
  SplitCandidate best;
  Eigen::Index tested = 0;
  Eigen::Index evaluations = 0;
  for (int j = 0; j < std::ssize(edges); ++j) {
    for (const SplitCandidate* candidate : {&edges[j].best, &inside[j]}) {
      tested += candidate->tested;
      evaluations += candidate->evaluations;
      const bool is_better = best.input < 0 || candidate->adjusted < best.adjusted - tolerance;
      const bool is_before =
          best.input == j && candidate->left < best.left && candidate->adjusted <= best.adjusted + tolerance;
      if (candidate->input >= 0 && (is_better || is_before)) {
        best = *candidate;
        best.input = j;
      }
    }
  }
  best.tested = tested;
  best.evaluations = evaluations;
  return best;
}

SplitCandidate BinnedRows::search(const Histogram& histogram, const std::vector<int>& rows, double node_rss, int rank,
                                  double& excess) const {
  const SearchNode node{features(), data_.output_weights, node_rss, total(histogram)[0], rank};
  const AdjustedRss scale = node.scale();
  std::vector<Edges> edges(inputs_.bins.size());
  parallel_for(std::ssize(edges), data_.threads_for(size_of_histogram() / 4),
               [&](Eigen::Index j) { edges[j] = search_edges(histogram, rows, j, scale); });
  double smallest = no_edge;
  Eigen::Index compared = 0;
  for (const Edges& input : edges) {
    if (input.best.input >= 0 || !input.best.level_side.empty()) smallest = std::min(smallest, input.best.adjusted);
    compared += input.best.tested;
  }
  const double limit = data_.significant_rss(node.weight, rank, node_rss, compared);
  smallest = std::min(smallest, limit);
  const ChosenBins chosen = choose_bins(promising_bins(edges, scale, smallest), edges, std::ssize(rows));
  std::vector<SplitCandidate> inside(edges.size());
  parallel_for(std::ssize(inside), data_.threads_for(chosen.rows * 8), [&](Eigen::Index j) {
    data_.problem.check(std::ssize(rows));
    if (!chosen.of_input[j].empty()) inside[j] = look_into(edges[j], chosen.of_input[j], j, rows, node, smallest);
  });
  const SplitCandidate best = best_of(edges, inside, node_rss);
  const bool is_found = best.input >= 0 && best.rss <= limit;
  excess = is_found ? std::max(0.0, best.adjusted - chosen.first_bound_left_out) : 0.0;
  return best;
}

}  // namespace llmt
