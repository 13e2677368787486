#include "histogram.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "parallel.hpp"

namespace llmt {
namespace {

/// Doubles that the histogram of a node may take; where Gram matrices are large, the bins are fewer.
constexpr std::ptrdiff_t histogram_size = std::ptrdiff_t{1} << 21;
constexpr int fewest_bins = 32;

/// Rows at a time, so few that their features stay in the cache.
constexpr std::ptrdiff_t block_rows = 4096;

}  // namespace

BinnedRows::BinnedRows(const GrowthData& data)
    : data_(data),
      features_(data.training.count(), std::ssize(data.training.regressors) + 1, data.outputs.cols()),
      shape_(features_) {
  const std::ptrdiff_t bins = histogram_size / (shape_.size() * data.split_inputs());
  inputs_ = make_bins(data, static_cast<int>(std::clamp<std::ptrdiff_t>(bins, fewest_bins, most_bins)));
  std::ptrdiff_t sum = 0;
  for (const Bins& input : inputs_.bins) {
    first_bin_.push_back(sum);
    sum += input.count;
  }
  first_bin_.push_back(sum);
  fill_features();
}

/// Regressors are whitened over all rows; residuals are those of the mean.
void BinnedRows::fill_features() {
  const TrainingRows& training = data_.training;
  const std::ptrdiff_t regressors = std::ssize(training.regressors);
  const std::ptrdiff_t chunks = num_chunks(training);
  const int threads = data_.problem.max_threads;
  const Eigen::RowVectorXd per_scale = training.scale.cwiseInverse().transpose();
  constexpr std::ptrdiff_t blocks = 64;  // partial sums, added up in order
  std::vector<std::vector<double>> grams(blocks, std::vector<double>(static_cast<std::size_t>(shape_.size()), 0.0));
  parallel_for(blocks, threads, [&](std::ptrdiff_t block) {
    std::vector<int> rows;
    for (std::ptrdiff_t index = chunks * block / blocks; index < chunks * (block + 1) / blocks; ++index) {
      const Chunk chunk = fetch(training, index, {});
      for (std::ptrdiff_t i = 0; i < chunk.count(); ++i) {
        const std::ptrdiff_t at = index * chunk_rows + i;
        const double root = std::sqrt(chunk.weights(i));
        double* row = features_.row(at);
        row[0] = root;
        Eigen::Map<Eigen::RowVectorXd>(row + 1, regressors) = root * chunk.deviations.row(i).cwiseProduct(per_scale);
        Eigen::Map<Eigen::RowVectorXd>(row + 1 + regressors, data_.outputs.cols()) = root * data_.outputs.row(at);
        rows.push_back(static_cast<int>(at));
      }
    }
    add_rows(features_, rows.data(), std::ssize(rows), grams[static_cast<std::size_t>(block)].data());
  });
  for (std::size_t block = 1; block < grams.size(); ++block) {
    add(shape_, grams[block].data(), grams[0].data());
  }
  Eigen::MatrixXd covariance(regressors, regressors);
  for (std::ptrdiff_t i = 0; i < regressors; ++i) {
    for (std::ptrdiff_t j = 0; j <= i; ++j) {
      covariance(i, j) = covariance(j, i) = grams[0][static_cast<std::size_t>(shape_.at(i + 1, j + 1))] / grams[0][0];
    }
  }
  const Whitening whitening = whiten(covariance);
  const Eigen::MatrixXd& forward = whitening.forward;
  colouring_ = whitening.back;
  parallel_for(chunks, threads, [&](std::ptrdiff_t index) {
    const std::ptrdiff_t begin = index * chunk_rows;
    const std::ptrdiff_t count = std::min(chunk_rows, training.count() - begin);
    using Stride = Eigen::OuterStride<>;
    Eigen::Map<RowMajor, 0, Stride> block(features_.row(begin) + 1, count, regressors, Stride(features_.columns()));
    const RowMajor whitened = block * forward;
    block = whitened;
  });
}

std::span<const double> BinnedRows::grams(const Histogram& histogram, std::size_t input) const {
  const std::ptrdiff_t first = first_bin_[input] * shape_.size();
  return std::span(histogram.grams)
      .subspan(static_cast<std::size_t>(first),
               static_cast<std::size_t>(first_bin_[input + 1] * shape_.size() - first));
}

std::span<const std::ptrdiff_t> BinnedRows::counts(const Histogram& histogram, std::size_t input) const {
  return std::span(histogram.counts)
      .subspan(static_cast<std::size_t>(first_bin_[input]), static_cast<std::size_t>(inputs_.bins[input].count));
}

/// Rows are taken in blocks that stay in the cache while they are sorted into the bins of one input after the other.
/// Inputs are dealt to threads; each bin's sum is formed in the same order whatever their number.
Histogram BinnedRows::accumulate(const std::vector<int>& rows) const {
  Histogram histogram{std::vector<double>(static_cast<std::size_t>(first_bin_.back() * shape_.size()), 0.0),
                      std::vector<std::ptrdiff_t>(static_cast<std::size_t>(first_bin_.back()), 0)};
  const std::ptrdiff_t inputs = data_.split_inputs();
  const int threads = data_.threads_for(std::ssize(rows) * inputs);
  const std::ptrdiff_t groups = threads == 1 ? 1 : std::min<std::ptrdiff_t>(inputs, std::max(threads, 4));
  parallel_for(groups, threads, [&](std::ptrdiff_t group) {
    std::vector<int> sorted(block_rows);
    for (std::ptrdiff_t begin = 0; begin < std::ssize(rows); begin += block_rows) {
      const std::ptrdiff_t end = std::min(std::ssize(rows), begin + block_rows);
      for (std::ptrdiff_t k = begin; k < end; ++k) {
        features_.prefetch(rows[static_cast<std::size_t>(k)]);
      }
      for (std::ptrdiff_t j = inputs * group / groups; j < inputs * (group + 1) / groups; ++j) {
        const std::size_t input = static_cast<std::size_t>(j);
        const int bins = inputs_.bins[input].count;
        std::array<int, most_bins + 1> place{};
        for (std::ptrdiff_t k = begin; k < end; ++k) {
          ++place[1U + static_cast<std::size_t>(inputs_.code(rows[static_cast<std::size_t>(k)], input))];
        }
        const std::ptrdiff_t first = first_bin_[input];
        for (int bin = 0; bin < bins; ++bin) {
          const std::size_t at = static_cast<std::size_t>(bin);
          histogram.counts[static_cast<std::size_t>(first) + at] += place[at + 1];
          place[at + 1] += place[at];
        }
        for (std::ptrdiff_t k = begin; k < end; ++k) {
          const int row = rows[static_cast<std::size_t>(k)];
          sorted[static_cast<std::size_t>(place[static_cast<std::size_t>(inputs_.code(row, input))]++)] = row;
        }
        int at = 0;
        for (int bin = 0; bin < bins; ++bin) {
          const int after = place[static_cast<std::size_t>(bin)];
          if (after > at) {
            add_rows(features_, sorted.data() + at, after - at, histogram.grams.data() + (first + bin) * shape_.size());
          }
          at = after;
        }
      }
    }
  });
  return histogram;
}

std::vector<double> BinnedRows::total(const Histogram& histogram) const {
  std::vector<double> sum(static_cast<std::size_t>(shape_.size()), 0.0);
  const std::span<const double> of_input = grams(histogram, 0);
  const std::span<const std::ptrdiff_t> rows = counts(histogram, 0);
  for (std::size_t bin = 0; bin < rows.size(); ++bin) {
    if (rows[bin] > 0) {
      add(shape_, of_input.data() + static_cast<std::ptrdiff_t>(bin) * shape_.size(), sum.data());
    }
  }
  return sum;
}

void BinnedRows::subtract(const std::vector<int>& rows, const Eigen::VectorXd& value, const Eigen::MatrixXd& slope) {
  const std::ptrdiff_t regressors = slope.cols();
  // slope . x = (colouring' slope) . regressors
  const Eigen::MatrixXd of_features = slope * colouring_;
  for (const int row : rows) {
    double* const at = features_.row(row);
    const Eigen::Map<const Eigen::VectorXd> x(at + 1, regressors);
    for (std::ptrdiff_t o = 0; o < value.size(); ++o) {
      at[1 + regressors + o] -= value(o) * at[0] + of_features.row(o).dot(x);
    }
  }
}

std::pair<double, double> BinnedRows::gap(const std::vector<int>& rows, const SplitCandidate& split) const {
  double low = -std::numeric_limits<double>::infinity();
  double high = -low;
  int bin_of_high = most_bins;
  for (const int row : rows) {
    // Values are looked at in the split's bin and the next one that has rows.
    const int code = inputs_.code(row, static_cast<std::size_t>(split.input));
    if (code < split.bin || code > bin_of_high) {
      continue;
    }
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
  const std::size_t input = static_cast<std::size_t>(split.input);
  const int code = inputs_.code(row, input);
  if (data_.num_levels[input] > 0) {
    return split.level_side[static_cast<std::size_t>(code)] < 0;
  }
  return code < split.bin || (code == split.bin && data_.split_value(row, split.input) <= split.last_left);
}

}  // namespace llmt
