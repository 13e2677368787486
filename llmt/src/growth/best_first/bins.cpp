#include "growth/best_first/bins.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "base/between.hpp"
#include "base/count.hpp"
#include "base/parallel.hpp"

namespace llmt {
namespace {

// The edges are quantiles of a sample of this size: 250 rows a bin, which give a bin's share of the rows to 6 %.
constexpr Eigen::Index sample_rows = 65536;

// At most bins - 1 edges, each between two neighbouring values of the sample.
std::vector<double> quantile_edges(std::vector<double> values, int bins) {
  std::ranges::sort(values);
  std::vector<double> distinct = values;
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  std::vector<double> edges;
  if (std::ssize(distinct) <= bins) {
    for (std::size_t k = 0; k + 1 < distinct.size(); ++k) {
      edges.push_back(between(distinct[k], distinct[k + 1]));
    }
    return edges;
  }
  for (std::size_t bin = 1; bin < static_cast<std::size_t>(bins); ++bin) {
    const double value = values[bin * values.size() / bins];
    const auto next = std::ranges::upper_bound(values, value);
    if (next != values.end()) {
      const double edge = between(value, *next);
      if (edges.empty() || edges.back() < edge) {
        edges.push_back(edge);
      }
    }
  }
  return edges;
}

// Codes of the rows begin ... end - 1 of a numeric input: the number of edges below the value. It is found by bisection
// in steps of powers of two, without branches and for several values at a time.
void encode(const GrowthData& data, Eigen::Index split_input, const std::vector<double>& edges, int begin, int end,
            std::uint8_t* codes, std::vector<Extent>& extent) {
  std::array<double, most_bins> padded;
  padded.fill(std::numeric_limits<double>::infinity());
  std::ranges::copy(edges, padded.begin());
  const std::size_t stride = data.split_inputs();
  constexpr int at_once = 16;
  std::array<double, at_once> value{};
  std::array<std::uint32_t, at_once> below{};
  for (; begin < end; begin += at_once) {
    const std::size_t count = std::min(at_once, end - begin);
    for (std::size_t k = 0; k < count; ++k) {
      value[k] = data.split_value(begin + static_cast<int>(k), split_input);
    }
    below.fill(0);
    for (std::uint32_t step = most_bins / 2; step > 0; step /= 2) {
      for (std::size_t k = 0; k < at_once; ++k) {
        below[k] += padded[below[k] + step - 1] < value[k] ? step : 0;
      }
    }
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t bin = below[k];
      codes[(begin + k) * stride] = static_cast<std::uint8_t>(bin);
      extent[bin].widen(value[k]);
    }
  }
}

// Bins of one split input, without `splittable`. `sampled`: rows that decide where the edges lie.
Bins cut_input(const GrowthData& data, const std::vector<int>& sampled, Eigen::Index split_input, int most) {
  Bins bins;
  bins.count = data.num_levels[split_input];
  if (bins.count > 0) return bins;
  std::vector<double> values;
  for (const int row : sampled) {
    values.push_back(data.split_value(row, split_input));
  }
  bins.edges = quantile_edges(std::move(values), most);
  bins.count = count_of(bins.edges) + 1;
  return bins;
}

// Smallest and largest value in each bin of each numeric input.
using Extents = std::vector<std::vector<Extent>>;

// Codes of some rows in all split inputs.
void encode_rows(const GrowthData& data, RowSpan rows, BinnedInputs& inputs, Extents& extents) {
  const std::size_t count = inputs.bins.size();
  const int begin = static_cast<int>(rows.begin);
  const int end = static_cast<int>(rows.end);
  for (std::size_t j = 0; j < count; ++j) {
    if (data.num_levels[j] == 0) {
      encode(data, j, inputs.bins[j].edges, begin, end, inputs.codes.data() + j, extents[j]);
      continue;
    }
    for (int row = begin; row < end; ++row) {
      inputs.codes[row * count + j] = static_cast<std::uint8_t>(data.split_value(row, j));
    }
  }
}

}  // namespace

BinnedInputs make_bins(const GrowthData& data, int bins) {
  const std::size_t inputs = data.split_inputs();
  const int threads = data.problem.max_threads;
  BinnedInputs result{std::vector<Bins>(inputs), std::vector<std::uint8_t>(data.training.count() * inputs)};
  const std::vector<int> sampled = smallest_hashes(data.training, sample_rows, threads);
  parallel_for(data.split_inputs(), threads,
               [&](Eigen::Index j) { result.bins[j] = cut_input(data, sampled, j, bins); });
  Extents nothing;
  for (const Bins& input : result.bins) nothing.emplace_back(input.count);
  const Extents extents = sum_over(RowBlocks{data.training.count(), large_block_rows}, threads, std::move(nothing),
                                   [&](RowSpan block, Extents& sum) { encode_rows(data, block, result, sum); });
  for (std::size_t j = 0; j < inputs; ++j) {
    for (const Extent& extent : extents[j]) result.bins[j].splittable.push_back(extent.low < extent.high);
  }
  return result;
}

}  // namespace llmt
