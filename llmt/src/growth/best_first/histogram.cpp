#include "growth/best_first/histogram.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "base/parallel.hpp"

namespace llmt {
namespace {

// Number of doubles that the histogram of a node may take. Where Gram matrices are large there are fewer bins.
constexpr Eigen::Index histogram_size = Eigen::Index{1} << 21;
constexpr int fewest_bins = 32;

// Rows that are sorted into bins at a time: few enough that their features stay in the cache.
constexpr Eigen::Index block_rows = 4096;

Eigen::Index bins_of_input(const GramShape& shape, Eigen::Index inputs) {
  return std::clamp<Eigen::Index>(histogram_size / (shape.size() * inputs), fewest_bins, most_bins);
}

}  // namespace

Eigen::Index BinnedRows::size_of_histogram(const GrowthData& data) {
  const GramShape shape(std::ssize(data.training.regressors) + 1, data.outputs.cols());
  Eigen::Index bins = 0;
  for (const int levels : data.num_levels) bins += levels > 0 ? levels : bins_of_input(shape, data.split_inputs());
  return shape.size() * bins;
}

BinnedRows::BinnedRows(const GrowthData& data) : data_(data), whitened_(data), shape_(whitened_.features()) {
  inputs_ = make_bins(data, static_cast<int>(bins_of_input(shape_, data.split_inputs())));
  Eigen::Index sum = 0;
  for (const Bins& input : inputs_.bins) {
    first_bin_.push_back(sum);
    sum += input.count;
  }
  first_bin_.push_back(sum);
}

std::span<const double> BinnedRows::grams(const Histogram& histogram, std::size_t input) const {
  const Eigen::Index first = first_bin_[input] * shape_.size();
  return std::span(histogram.grams).subspan(first, (first_bin_[input + 1] * shape_.size() - first));
}

std::span<const Eigen::Index> BinnedRows::counts(const Histogram& histogram, std::size_t input) const {
  return std::span(histogram.counts).subspan(first_bin_[input], inputs_.bins[input].count);
}

// Rows are taken in blocks that stay in the cache while they are sorted into the bins of one input after the other.
// Inputs are dealt to threads; each bin's sum is formed in the same order whatever their number.
Histogram BinnedRows::accumulate(const std::vector<int>& rows) const {
  Histogram histogram{std::vector<double>(first_bin_.back() * shape_.size(), 0.0),
                      std::vector<Eigen::Index>(first_bin_.back(), 0)};
  const Eigen::Index inputs = data_.split_inputs();
  const int threads = data_.threads_for(std::ssize(rows) * inputs);
  const Eigen::Index groups = threads == 1 ? 1 : std::min<Eigen::Index>(inputs, std::max(threads, 4));
  parallel_for(groups, threads, [&](Eigen::Index group) {
    std::vector<int> sorted(block_rows);
    for (Eigen::Index begin = 0; begin < std::ssize(rows); begin += block_rows) {
      data_.problem.check(std::ssize(rows));
      const Eigen::Index end = std::min(std::ssize(rows), begin + block_rows);
      const std::span<const int> block = std::span(rows).subspan(begin, end - begin);
      for (const int row : block) {
        features().prefetch(row);
      }
      for (Eigen::Index j = inputs * group / groups; j < inputs * (group + 1) / groups; ++j) {
        add_block(block, j, sorted, histogram);
      }
    }
  });
  return histogram;
}

// Adds some rows to the bins of one input. `sorted`: work space for the rows.
void BinnedRows::add_block(std::span<const int> rows, std::size_t input, std::vector<int>& sorted,
                           Histogram& histogram) const {
  const int bins = inputs_.bins[input].count;
  const Eigen::Index first = first_bin_[input];
  std::array<int, most_bins + 1> place{};  // where the rows of a bin begin among the sorted rows
  for (const int row : rows) {
    ++place[1 + inputs_.code(row, input)];
  }
  for (int bin = 0; bin < bins; ++bin) {
    histogram.counts[first + bin] += place[bin + 1];
    place[bin + 1] += place[bin];
  }
  for (const int row : rows) {
    sorted[place[inputs_.code(row, input)]++] = row;
  }
  int at = 0;
  for (int bin = 0; bin < bins; ++bin) {
    const int after = place[bin];
    if (after > at) {
      add_rows(features(), sorted.data() + at, after - at, histogram.grams.data() + (first + bin) * shape_.size());
    }
    at = after;
  }
}

std::vector<double> BinnedRows::total(const Histogram& histogram) const {
  std::vector<double> sum(shape_.size(), 0.0);
  const std::span<const double> of_input = grams(histogram, 0);
  const std::span<const Eigen::Index> rows = counts(histogram, 0);
  for (std::size_t bin = 0; bin < rows.size(); ++bin) {
    if (rows[bin] > 0) {
      add(shape_, of_input.data() + bin * shape_.size(), sum.data());
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
