#include "growth/best_first/bins.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "base/count.hpp"
#include "base/parallel.hpp"

namespace llmt {
namespace {

// About this many rows decide where the edges lie. These are 250 rows per bin, which give a bin's share of the rows to
// 6 %.
constexpr Eigen::Index sample_rows = 65536;

// Rows whose values, taken together, hash to a small number: the same rows in whatever order they come.
std::vector<int> sample(const GrowthData& data) {
  const Eigen::Index rows = data.training.count();
  const std::uint64_t ratio = static_cast<std::uint64_t>(std::max<Eigen::Index>(1, rows / sample_rows));
  constexpr Eigen::Index block = 4096;
  const Eigen::Index blocks = (rows + block - 1) / block;
  std::vector<std::vector<int>> taken(blocks);
  parallel_for(blocks, data.problem.max_threads, [&](Eigen::Index index) {
    const int begin = static_cast<int>(index * block);
    std::vector<std::uint64_t> hashes(std::min(block, rows - begin), 0);
    for (Eigen::Index j = 0; j < data.split_inputs(); ++j) {
      for (std::size_t k = 0; k < hashes.size(); ++k) {
        // Adding zero turns -0 into +0, which is the same value.
        const double value = data.split_value(begin + static_cast<int>(k), j) + 0.0;
        std::uint64_t hash = hashes[k] ^ std::bit_cast<std::uint64_t>(value);
        hash = (hash ^ (hash >> 32)) * 0x9E3779B97F4A7C15U;
        hashes[k] = hash ^ (hash >> 29);
      }
    }
    for (std::size_t k = 0; k < hashes.size(); ++k) {
      if (hashes[k] % ratio == 0) {
        taken[index].push_back(begin + static_cast<int>(k));
      }
    }
  });
  std::vector<int> all;
  for (const std::vector<int>& of_block : taken) {
    all.insert(all.end(), of_block.begin(), of_block.end());
  }
  return all;
}

// At most bins - 1 edges, each between two neighbouring values of the sample.
std::vector<double> quantile_edges(std::vector<double> values, int bins) {
  std::ranges::sort(values);
  std::vector<double> distinct = values;
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  const auto between = [](double low, double high) {
    return std::min(low + 0.5 * (high - low), std::nextafter(high, low));
  };
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

// Smallest and largest value in each bin.
struct Extent {
  std::array<double, most_bins> low;
  std::array<double, most_bins> high;
};

// Codes of the rows begin ... end - 1 of a numeric input: the number of edges below the value. It is found by bisection
// in steps of powers of two, without branches and for several values at a time.
void encode(const GrowthData& data, Eigen::Index split_input, const std::vector<double>& edges, int begin, int end,
            std::uint8_t* codes, Extent& extent) {
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
      extent.low[bin] = std::min(extent.low[bin], value[k]);
      extent.high[bin] = std::max(extent.high[bin], value[k]);
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

// Codes of the rows begin ... end - 1 in all split inputs. Widens `extents`, one per input.
void encode_rows(const GrowthData& data, int begin, int end, BinnedInputs& inputs, std::vector<Extent>& extents) {
  const std::size_t count = inputs.bins.size();
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
  const int rows = static_cast<int>(data.training.count());
  const int threads = data.problem.max_threads;
  BinnedInputs result{std::vector<Bins>(inputs), std::vector<std::uint8_t>(rows * inputs)};
  const std::vector<int> sampled = sample(data);
  parallel_for(data.split_inputs(), threads,
               [&](Eigen::Index j) { result.bins[j] = cut_input(data, sampled, j, bins); });
  constexpr int block = 16384;  // rows
  constexpr int slots = 16;
  Extent nothing;
  nothing.low.fill(std::numeric_limits<double>::infinity());
  nothing.high.fill(-std::numeric_limits<double>::infinity());
  std::vector<std::vector<Extent>> extents(slots, std::vector<Extent>(inputs, nothing));
  parallel_for(slots, threads, [&](Eigen::Index slot) {
    for (int begin = static_cast<int>(slot) * block; begin < rows; begin += slots * block) {
      encode_rows(data, begin, std::min(rows, begin + block), result, extents[slot]);
    }
  });
  for (std::size_t j = 0; j < inputs; ++j) {
    for (int bin = 0; bin < result.bins[j].count; ++bin) {
      double low = nothing.low[bin];
      double high = nothing.high[bin];
      for (const std::vector<Extent>& extent : extents) {
        low = std::min(low, extent[j].low[bin]);
        high = std::max(high, extent[j].high[bin]);
      }
      result.bins[j].splittable.push_back(low < high);
    }
  }
  return result;
}

}  // namespace llmt
