#include "bins.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "parallel.hpp"

namespace llmt {
namespace {

/// About this many rows decide where the edges lie: 250 a bin, so that a bin's share is known to 6 %.
constexpr std::ptrdiff_t sample_rows = 65536;

/// Rows whose values, taken together, hash to a small number: the same rows in whatever order they come.
std::vector<int> sample(const GrowthData& data) {
  const std::ptrdiff_t rows = data.training.count();
  const std::uint64_t ratio = static_cast<std::uint64_t>(std::max<std::ptrdiff_t>(1, rows / sample_rows));
  std::vector<int> taken;
  std::vector<std::uint64_t> hashes;
  constexpr std::ptrdiff_t block = 4096;
  for (std::ptrdiff_t begin = 0; begin < rows; begin += block) {
    hashes.assign(static_cast<std::size_t>(std::min(block, rows - begin)), 0);
    for (std::ptrdiff_t j = 0; j < data.split_inputs(); ++j) {
      for (std::size_t k = 0; k < hashes.size(); ++k) {
        // Adding zero makes one of the two zeros.
        const double value = data.split_value(static_cast<int>(begin) + static_cast<int>(k), j) + 0.0;
        std::uint64_t hash = hashes[k] ^ std::bit_cast<std::uint64_t>(value);
        hash = (hash ^ (hash >> 32)) * 0x9E3779B97F4A7C15U;
        hashes[k] = hash ^ (hash >> 29);
      }
    }
    for (std::size_t k = 0; k < hashes.size(); ++k) {
      if (hashes[k] % ratio == 0) {
        taken.push_back(static_cast<int>(begin) + static_cast<int>(k));
      }
    }
  }
  return taken;
}

/// At most bins - 1 edges, each between two neighbouring values of the sample.
std::vector<double> quantile_edges(std::vector<double> values, int bins) {
  std::sort(values.begin(), values.end());
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
    const double value = values[bin * values.size() / static_cast<std::size_t>(bins)];
    const auto next = std::upper_bound(values.begin(), values.end(), value);
    if (next != values.end()) {
      const double edge = between(value, *next);
      if (edges.empty() || edges.back() < edge) {
        edges.push_back(edge);
      }
    }
  }
  return edges;
}

}  // namespace

std::vector<Bins> make_bins(const GrowthData& data, int bins) {
  const std::vector<int> sampled = sample(data);
  std::vector<Bins> all(static_cast<std::size_t>(data.split_inputs()));
  parallel_for(data.split_inputs(), data.problem.max_threads, [&](std::ptrdiff_t j) {
    Bins& result = all[static_cast<std::size_t>(j)];
    const int levels = data.num_levels[static_cast<std::size_t>(j)];
    const int rows = static_cast<int>(data.training.count());
    result.codes.resize(static_cast<std::size_t>(rows));
    if (levels > 0) {
      result.count = levels;
      for (int row = 0; row < rows; ++row) {
        result.codes[static_cast<std::size_t>(row)] = static_cast<std::uint8_t>(data.split_value(row, j));
      }
      return;
    }
    std::vector<double> values;
    for (const int row : sampled) {
      values.push_back(data.split_value(row, j));
    }
    result.edges = quantile_edges(std::move(values), bins);
    result.count = static_cast<int>(std::ssize(result.edges)) + 1;
    // The number of edges below the value: steps of powers of two, without branches, for some values at a time.
    std::vector<double> padded(most_bins, std::numeric_limits<double>::infinity());
    std::copy(result.edges.begin(), result.edges.end(), padded.begin());
    constexpr int at_once = 16;
    std::array<double, at_once> value{};
    std::array<std::uint32_t, at_once> below{};
    std::vector<double> low(static_cast<std::size_t>(result.count), std::numeric_limits<double>::infinity());
    std::vector<double> high(low.size(), -std::numeric_limits<double>::infinity());
    for (int begin = 0; begin < rows; begin += at_once) {
      const int count = std::min(at_once, rows - begin);
      for (int k = 0; k < count; ++k) {
        value[static_cast<std::size_t>(k)] = data.split_value(begin + k, j);
      }
      below.fill(0);
      for (std::uint32_t step = most_bins / 2; step > 0; step /= 2) {
        for (std::size_t k = 0; k < at_once; ++k) {
          below[k] += padded[below[k] + step - 1] < value[k] ? step : 0;
        }
      }
      for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
        const std::uint32_t bin = below[k];
        result.codes[static_cast<std::size_t>(begin) + k] = static_cast<std::uint8_t>(bin);
        low[bin] = std::min(low[bin], value[k]);
        high[bin] = std::max(high[bin], value[k]);
      }
    }
    for (std::size_t bin = 0; bin < low.size(); ++bin) {
      result.splittable.push_back(low[bin] < high[bin]);
    }
  });
  return all;
}

}  // namespace llmt
