#include "growth/best_first/histogram.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "base/parallel.hpp"
#include "base/sum_over.hpp"

namespace llmt {
namespace {

// Number of doubles that the histogram of a node may take. Where Gram matrices are large there are fewer bins.
constexpr Eigen::Index histogram_size = Eigen::Index{1} << 21;
constexpr int fewest_bins = 32;

// Rows that are sorted into bins at a time: few enough that their features stay in the cache.
constexpr Eigen::Index cached_rows = 4096;

Eigen::Index bins_of_input(const GramShape& shape, Eigen::Index inputs) {
  return std::clamp<Eigen::Index>(histogram_size / (shape.size() * inputs), fewest_bins, most_bins);
}

}  // namespace

void subtract(const Histogram& less, Histogram& histogram) {
  for (std::size_t j = 0; j < less.size(); ++j) {
    for (std::size_t k = 0; k < less[j].grams.size(); ++k) histogram[j].grams[k] -= less[j].grams[k];
    for (std::size_t bin = 0; bin < less[j].counts.size(); ++bin) histogram[j].counts[bin] -= less[j].counts[bin];
  }
}

Eigen::Index BinnedRows::largest_histogram(const GrowthData& data) {
  const GramShape shape(std::ssize(data.training.regressors) + 1, data.outputs.cols());
  Eigen::Index bins = 0;
  for (const int levels : data.num_levels) bins += levels > 0 ? levels : bins_of_input(shape, data.split_inputs());
  return shape.size() * bins;
}

BinnedRows::BinnedRows(const GrowthData& data) : data_(data), whitened_(data), shape_(whitened_.features()) {
  inputs_ = make_bins(data, static_cast<int>(bins_of_input(shape_, data.split_inputs())));
  for (const Bins& input : inputs_.bins) num_bins_ += input.count;
}

// Inputs are dealt to threads. Rows are taken in parts that stay in the cache while they are sorted into the bins of
// one input after the other.
Histogram BinnedRows::accumulate(const std::vector<int>& rows) const {
  const Eigen::Index inputs = data_.split_inputs();
  const int threads = data_.threads_for(std::ssize(rows) * inputs);
  const Eigen::Index groups = threads == 1 ? 1 : std::min<Eigen::Index>(inputs, std::max(threads, 4));
  Histogram histogram(inputs);
  parallel_for(groups, threads, [&](Eigen::Index group) {
    const Eigen::Index first = inputs * group / groups;
    Histogram zero;
    for (Eigen::Index j = first; j < inputs * (group + 1) / groups; ++j) {
      const std::size_t bins = inputs_.bins[j].count;
      zero.push_back({std::vector<double>(bins * shape_.size(), 0.0), std::vector<Eigen::Index>(bins, 0)});
    }
    std::vector<int> sorted(cached_rows);
    const auto add_block = [&](RowSpan block, Histogram& sum) {
      for (Eigen::Index begin = block.begin; begin < block.end; begin += cached_rows) {
        data_.problem.check(std::ssize(rows));
        const std::span<const int> part = std::span(rows).subspan(begin, std::min(cached_rows, block.end - begin));
        for (const int row : part) features().prefetch(row);
        for (std::size_t j = 0; j < sum.size(); ++j) add(part, first + j, sorted, sum[j]);
      }
    };
    Histogram of_group = sum_over(RowBlocks{std::ssize(rows), large_block_rows}, 1, std::move(zero), add_block);
    std::ranges::move(of_group, histogram.begin() + first);
  });
  return histogram;
}

// Adds some rows to the bins of one input. `sorted`: work space for the rows.
void BinnedRows::add(std::span<const int> rows, std::size_t input, std::vector<int>& sorted,
                     InputHistogram& histogram) const {
  const int bins = inputs_.bins[input].count;
  std::array<int, most_bins + 1> place{};  // where the rows of a bin begin among the sorted rows
  for (const int row : rows) {
    ++place[1 + inputs_.code(row, input)];
  }
  for (int bin = 0; bin < bins; ++bin) {
    histogram.counts[bin] += place[bin + 1];
    place[bin + 1] += place[bin];
  }
  for (const int row : rows) {
    sorted[place[inputs_.code(row, input)]++] = row;
  }
  int at = 0;
  for (int bin = 0; bin < bins; ++bin) {
    const int after = place[bin];
    if (after > at) {
      add_rows(features(), sorted.data() + at, after - at, histogram.grams.data() + bin * shape_.size());
    }
    at = after;
  }
}

std::vector<double> BinnedRows::total(const Histogram& histogram) const {
  std::vector<double> sum(shape_.size(), 0.0);
  const InputHistogram& of_input = histogram.front();
  for (std::size_t bin = 0; bin < of_input.counts.size(); ++bin) {
    if (of_input.counts[bin] > 0) {
      llmt::add(shape_, of_input.grams.data() + bin * shape_.size(), sum.data());
    }
  }
  return sum;
}

std::pair<double, double> BinnedRows::gap(const std::vector<int>& rows, const SplitCandidate& split) const {
  double low = -std::numeric_limits<double>::infinity();
  double high = -low;
  int bin_of_high = most_bins;
  for (const int row : rows) {
    // Values are looked at in the split's bin and the next one that has rows.
    const int code = inputs_.code(row, split.input);
    if (code < split.bin || code > bin_of_high) continue;
    const double value = data_.split_value(row, split.input);
    if (code == split.bin && value <= split.last_left) {
      low = std::max(low, value);
    } else {
      high = std::min(high, value);
      bin_of_high = code;
    }
  }
  return {low, high};
}

bool BinnedRows::goes_left(int row, const SplitCandidate& split) const {
  const std::size_t input = split.input;
  const int code = inputs_.code(row, input);
  if (data_.num_levels[input] > 0) return split.level_side[code] < 0;
  return code < split.bin || (code == split.bin && data_.split_value(row, split.input) <= split.last_left);
}

}  // namespace llmt
