#include "binned_leaves.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "parallel.hpp"

namespace llmt {
namespace {

/// Doubles that the histogram of a node may take; where Gram matrices are large, the bins are fewer.
constexpr std::ptrdiff_t histogram_size = std::ptrdiff_t{1} << 21;
constexpr int fewest_bins = 32;

/// Histograms of leaves that wait may take this part of what the features take, and at least as much as this many
/// nodes.
constexpr std::ptrdiff_t kept_part = 4;
constexpr std::ptrdiff_t kept_nodes = 8;

/// A node with so small a part of the sum of squares that the features hold gets features of its own residuals.
constexpr double digits_at_risk = 1e-4;

/// Directions whose variance is below this part of the largest count as none: the digits of a sum of squares.
constexpr double covariance_tolerance = 1e-10;

constexpr std::ptrdiff_t block_rows = 4096;

/// A pseudo-inverse square root: columns that make a covariance the identity on the directions that there are.
struct Whitening {
  Eigen::MatrixXd forward;
  Eigen::MatrixXd back;
  std::ptrdiff_t rank = 0;
};

Whitening whiten(const Eigen::MatrixXd& covariance) {
  const std::ptrdiff_t size = covariance.rows();
  Whitening result{Eigen::MatrixXd::Zero(size, size), Eigen::MatrixXd::Zero(size, size), 0};
  if (size == 0) {
    return result;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  const double smallest = covariance_tolerance * std::max(eigen.eigenvalues().maxCoeff(), 0.0);
  for (std::ptrdiff_t k = size; k-- > 0;) {
    if (const double value = eigen.eigenvalues()(k); value > smallest && value > 0.0) {
      result.forward.col(result.rank) = eigen.eigenvectors().col(k) / std::sqrt(value);
      result.back.col(result.rank) = eigen.eigenvectors().col(k) * std::sqrt(value);
      ++result.rank;
    }
  }
  return result;
}

}  // namespace

bool BinnedLeaves::possible(const GrowthData& data) {
  const bool few_levels =
      std::all_of(data.num_levels.begin(), data.num_levels.end(), [](int levels) { return levels <= most_bins; });
  const auto complete = [&](int input) { return !data.training.table->inputs.col(input).hasNaN(); };
  const std::vector<int>& inputs = data.problem.options.split_inputs;
  return few_levels && !data.training.has_missing && std::all_of(inputs.begin(), inputs.end(), complete);
}

BinnedLeaves::BinnedLeaves(const GrowthData& data)
    : data_(data),
      features_(data.training.count(), std::ssize(data.training.regressors) + 1, data.outputs.cols()),
      shape_(features_) {
  const std::ptrdiff_t bins = histogram_size / (shape_.size() * data.split_inputs());
  bins_ = make_bins(data, static_cast<int>(std::clamp<std::ptrdiff_t>(bins, fewest_bins, most_bins)));
  std::ptrdiff_t sum = 0;
  for (const Bins& input : bins_) {
    first_bin_.push_back(sum);
    sum += input.count;
  }
  first_bin_.push_back(sum);
  memory_left_ = std::max(features_.rows() * features_.columns() / kept_part, kept_nodes * sum * shape_.size());
  fill_features();
}

/// Regressors are whitened over all rows; residuals are those of the mean.
void BinnedLeaves::fill_features() {
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
        const std::ptrdiff_t at = chunk.begin + i;
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
  Whitening whitening = whiten(covariance);
  whitening_ = std::move(whitening.forward);
  colouring_ = std::move(whitening.back);
  parallel_for(chunks, threads, [&](std::ptrdiff_t index) {
    const std::ptrdiff_t begin = index * chunk_rows;
    const std::ptrdiff_t count = std::min(chunk_rows, training.count() - begin);
    using Stride = Eigen::OuterStride<>;
    Eigen::Map<RowMajor, 0, Stride> block(features_.row(begin) + 1, count, regressors, Stride(features_.columns()));
    const RowMajor whitened = block * whitening_;
    block = whitened;
  });
}

std::span<const double> BinnedLeaves::grams(const Histogram& histogram, std::size_t input) const {
  const std::ptrdiff_t first = first_bin_[input] * shape_.size();
  return std::span(histogram.grams)
      .subspan(static_cast<std::size_t>(first),
               static_cast<std::size_t>(first_bin_[input + 1] * shape_.size() - first));
}

std::span<const std::ptrdiff_t> BinnedLeaves::counts(const Histogram& histogram, std::size_t input) const {
  return std::span(histogram.counts)
      .subspan(static_cast<std::size_t>(first_bin_[input]), static_cast<std::size_t>(bins_[input].count));
}

BinnedLeaf BinnedLeaves::root() const {
  BinnedLeaf leaf;
  leaf.rows.resize(static_cast<std::size_t>(data_.training.count()));
  std::iota(leaf.rows.begin(), leaf.rows.end(), 0);
  leaf.histogram = accumulate(leaf.rows);
  leaf.value = Eigen::VectorXd::Zero(data_.outputs.cols());
  leaf.slope = Eigen::MatrixXd::Zero(data_.outputs.cols(), std::ssize(data_.training.regressors));
  return leaf;
}

/// Rows are taken in blocks that stay in the cache while they are sorted into the bins of one input after the other.
/// Inputs are dealt to threads; each bin's sum is formed in the same order whatever their number.
Histogram BinnedLeaves::accumulate(const std::vector<int>& rows) const {
  Histogram histogram{std::vector<double>(static_cast<std::size_t>(first_bin_.back() * shape_.size()), 0.0),
                      std::vector<std::ptrdiff_t>(static_cast<std::size_t>(first_bin_.back()), 0)};
  const std::ptrdiff_t inputs = data_.split_inputs();
  const int threads = data_.threads_for(std::ssize(rows) * inputs);
  const std::ptrdiff_t groups = threads == 1 ? 1 : std::min<std::ptrdiff_t>(inputs, std::max(threads, 4));
  parallel_for(groups, threads, [&](std::ptrdiff_t group) {
    std::vector<int> sorted(block_rows);
    for (std::ptrdiff_t begin = 0; begin < std::ssize(rows); begin += block_rows) {
      const std::ptrdiff_t end = std::min(std::ssize(rows), begin + block_rows);
      for (std::ptrdiff_t j = inputs * group / groups; j < inputs * (group + 1) / groups; ++j) {
        const Bins& bins = bins_[static_cast<std::size_t>(j)];
        std::array<int, most_bins + 1> place{};
        for (std::ptrdiff_t k = begin; k < end; ++k) {
          ++place[1U + bins.codes[static_cast<std::size_t>(rows[static_cast<std::size_t>(k)])]];
        }
        const std::ptrdiff_t first = first_bin_[static_cast<std::size_t>(j)];
        for (int bin = 0; bin < bins.count; ++bin) {
          const std::size_t at = static_cast<std::size_t>(bin);
          histogram.counts[static_cast<std::size_t>(first) + at] += place[at + 1];
          place[at + 1] += place[at];
        }
        for (std::ptrdiff_t k = begin; k < end; ++k) {
          const int row = rows[static_cast<std::size_t>(k)];
          sorted[static_cast<std::size_t>(place[bins.codes[static_cast<std::size_t>(row)]]++)] = row;
        }
        int at = 0;
        for (int bin = 0; bin < bins.count; ++bin) {
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

std::vector<double> BinnedLeaves::total(const Histogram& histogram) const {
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

/// The local model as a correction of the parent's, of minimum norm in regressors of unit variance in the node.
void BinnedLeaves::fit(BinnedLeaf& leaf, const std::vector<double>& gram, const Node& parent, Node& node) const {
  const std::ptrdiff_t regressors = std::ssize(data_.training.regressors);
  const auto entry = [&](std::ptrdiff_t i, std::ptrdiff_t j) {
    return gram[static_cast<std::size_t>(i >= j ? shape_.at(i, j) : shape_.at(j, i))];
  };
  const double weight = entry(0, 0);
  Eigen::VectorXd mean(regressors);
  Eigen::MatrixXd covariance(regressors, regressors);
  for (std::ptrdiff_t i = 0; i < regressors; ++i) {
    mean(i) = entry(i + 1, 0) / weight;
  }
  for (std::ptrdiff_t i = 0; i < regressors; ++i) {
    for (std::ptrdiff_t j = 0; j < regressors; ++j) {
      covariance(i, j) = entry(i + 1, j + 1) / weight - mean(i) * mean(j);
    }
  }
  leaf.mean = colouring_ * mean;
  leaf.covariance = colouring_ * covariance * colouring_.transpose();
  Eigen::VectorXd deviation(regressors);  // 0: constant in the node
  for (std::ptrdiff_t k = 0; k < regressors; ++k) {
    const double variance = leaf.covariance(k, k);
    deviation(k) = variance > 1e-12 * (1.0 + leaf.mean(k) * leaf.mean(k)) ? std::sqrt(variance) : 0.0;
  }
  const Eigen::VectorXd per_deviation =
      deviation.unaryExpr([](double value) { return value > 0.0 ? 1.0 / value : 0.0; });
  const Whitening whitening = whiten(per_deviation.asDiagonal() * leaf.covariance * per_deviation.asDiagonal());
  const Eigen::MatrixXd inverse = whitening.forward * whitening.forward.transpose();
  const std::ptrdiff_t outputs = data_.outputs.cols();
  node.samples = std::ssize(leaf.rows);
  node.rank = 1 + static_cast<int>(whitening.rank);
  node.mean = data_.training.scale.cwiseProduct(leaf.mean);
  node.low = node.high = node.mean;
  node.rss.resize(outputs);
  node.value.resize(outputs);
  node.slope.resize(outputs, regressors);
  for (std::ptrdiff_t o = 0; o < outputs; ++o) {
    const std::ptrdiff_t residual = shape_.coefficients() + o;
    Eigen::VectorXd product(regressors);
    const double mean_residual = entry(residual, 0) / weight;
    for (std::ptrdiff_t k = 0; k < regressors; ++k) {
      product(k) = entry(residual, k + 1) / weight - mean_residual * mean(k);
    }
    // The parent's model about the one whose residuals the features hold, then the correction of it.
    const Eigen::VectorXd of_parent =
        data_.training.scale.cwiseProduct((parent.slope.row(o) - leaf.slope.row(o)).transpose());
    const Eigen::VectorXd left = colouring_ * product - leaf.covariance * of_parent;
    const Eigen::VectorXd correction = per_deviation.cwiseProduct(inverse * per_deviation.cwiseProduct(left));
    const Eigen::VectorXd slope = of_parent + correction;
    const double variance = entry(residual, residual) / weight - mean_residual * mean_residual;
    const double explained = 2.0 * slope.dot(colouring_ * product) - slope.dot(leaf.covariance * slope);
    node.rss(o) = std::max(0.0, weight * (variance - explained));
    node.slope.row(o) = leaf.slope.row(o) + slope.cwiseQuotient(data_.training.scale).transpose();
    node.value(o) = leaf.value(o) + mean_residual - slope.dot(leaf.mean);
  }
}

/// Lets the features of the leaf's rows hold the residuals of the node's model.
void BinnedLeaves::rebase(BinnedLeaf& leaf, const Node& node) {
  const std::ptrdiff_t regressors = std::ssize(data_.training.regressors);
  const Eigen::VectorXd value = node.value - leaf.value;
  // slope . x = slope . scale * (scaled x) = (colouring' (slope * scale)) . regressors
  const Eigen::MatrixXd slope = (node.slope - leaf.slope) * data_.training.scale.asDiagonal() * colouring_;
  for (const int row : leaf.rows) {
    double* const at = features_.row(row);
    const Eigen::Map<const Eigen::VectorXd> x(at + 1, regressors);
    for (std::ptrdiff_t o = 0; o < value.size(); ++o) {
      at[1 + regressors + o] -= value(o) * at[0] + slope.row(o).dot(x);
    }
  }
  leaf.value = node.value;
  leaf.slope = node.slope;
  leaf.histogram = accumulate(leaf.rows);
}

SplitCandidate BinnedLeaves::examine(BinnedLeaf& leaf, const Node& parent, Node& node, double& excess) {
  if (!leaf.histogram) {
    leaf.histogram = accumulate(leaf.rows);
  }
  const std::ptrdiff_t first_residual = shape_.coefficients();
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<double> gram = total(*leaf.histogram);
    fit(leaf, gram, parent, node);
    double held = 0.0;
    for (std::ptrdiff_t o = 0; o < data_.outputs.cols(); ++o) {
      held +=
          data_.output_weights(o) * gram[static_cast<std::size_t>(shape_.at(first_residual + o, first_residual + o))];
    }
    if (pass == 1 || data_.output_weights.dot(node.rss) >= digits_at_risk * held) {
      break;
    }
    rebase(leaf, node);
  }
  const double rss = data_.output_weights.dot(node.rss);
  const std::size_t inputs = bins_.size();
  std::vector<Found> found(inputs);
  parallel_for(std::ssize(found), data_.threads_for(first_bin_.back() * shape_.size() / 4), [&](std::ptrdiff_t j) {
    found[static_cast<std::size_t>(j)] = search(*leaf.histogram, static_cast<std::size_t>(j), rss);
  });
  SplitCandidate best;
  double smallest = std::numeric_limits<double>::infinity();
  double bound = smallest;
  std::ptrdiff_t tested = 0;
  for (const Found& input : found) {
    tested += input.best.tested;
    smallest = input.best.input >= 0 ? std::min(smallest, input.best.rss) : smallest;
    bound = std::min(bound, input.bound);
  }
  for (std::size_t j = 0; j < inputs && best.input < 0; ++j) {
    if (found[j].best.input >= 0 && found[j].best.rss <= smallest + tie_tolerance * rss) {
      best = found[j].best;
      best.input = static_cast<int>(j);
    }
  }
  best.tested = tested;
  best.evaluations = tested;
  excess = best.input >= 0 ? std::max(0.0, best.rss - bound) : 0.0;
  return best;
}

/// Compares the edges between the bins that hold rows.
BinnedLeaves::Found BinnedLeaves::search(const Histogram& histogram, std::size_t input, double node_rss) const {
  const std::span<const double> of_bin = grams(histogram, input);
  const std::span<const std::ptrdiff_t> rows = counts(histogram, input);
  const std::ptrdiff_t smallest_leaf = data_.problem.options.min_leaf_samples;
  if (data_.num_levels[input] > 0) {
    const SplitCandidate best =
        search_level_grams(shape_, data_.output_weights, node_rss, 0.0, of_bin, rows, smallest_leaf);
    return {best, std::numeric_limits<double>::infinity()};
  }
  std::vector<std::ptrdiff_t> held;  // bins with rows
  std::ptrdiff_t all = 0;
  for (std::size_t bin = 0; bin < rows.size(); ++bin) {
    if (rows[bin] > 0) {
      held.push_back(static_cast<std::ptrdiff_t>(bin));
      all += rows[bin];
    }
  }
  Found found{{}, std::numeric_limits<double>::infinity()};
  const std::ptrdiff_t edges = std::ssize(held) - 1;
  const std::ptrdiff_t size = shape_.size();
  const auto sums = [&](bool from_left, std::vector<double>& rss, std::vector<int>& rank) {
    std::vector<double> grams(static_cast<std::size_t>(std::max<std::ptrdiff_t>(edges, 0) * size), 0.0);
    std::vector<const double*> at(static_cast<std::size_t>(std::max<std::ptrdiff_t>(edges, 0)));
    const double* before = nullptr;
    for (std::ptrdiff_t step = 0; step < edges; ++step) {
      const std::ptrdiff_t edge = from_left ? step : edges - 1 - step;
      double* const gram = grams.data() + edge * size;
      if (before != nullptr) {
        std::copy(before, before + size, gram);
      }
      add(shape_, of_bin.data() + held[static_cast<std::size_t>(from_left ? edge : edge + 1)] * size, gram);
      before = at[static_cast<std::size_t>(edge)] = gram;
    }
    rss.resize(at.size());
    rank.resize(at.size());
    ResidualSums(shape_, data_.output_weights).evaluate(at.data(), edges, rss.data(), rank.data());
  };
  std::vector<double> rss_left;
  std::vector<double> rss_right;
  std::vector<int> rank_left;
  std::vector<int> rank_right;
  sums(true, rss_left, rank_left);
  sums(false, rss_right, rank_right);
  std::ptrdiff_t left = 0;
  SplitCandidate& best = found.best;
  for (std::size_t k = 0; k < held.size(); ++k) {
    const std::ptrdiff_t here = rows[static_cast<std::size_t>(held[k])];
    // A split inside this bin.
    if (bins_[input].splittable[static_cast<std::size_t>(held[k])] &&
        std::max(left + 1, smallest_leaf) <= std::min(left + here - 1, all - smallest_leaf)) {
      found.bound = std::min(
          found.bound, (k > 0 ? rss_left[k - 1] : 0.0) + (static_cast<std::ptrdiff_t>(k) < edges ? rss_right[k] : 0.0));
    }
    left += here;
    if (static_cast<std::ptrdiff_t>(k) == edges || left < smallest_leaf || all - left < smallest_leaf) {
      continue;
    }
    const double rss = rss_left[k] + rss_right[k];
    ++best.tested;
    if (best.input < 0 || rss < best.rss - tie_tolerance * node_rss) {
      best.input = 0;
      best.left = left;
      best.rss = rss;
      best.rank_left = rank_left[k];
      best.rank_right = rank_right[k];
      best.bin = static_cast<int>(held[k]);
    }
  }
  return found;
}

void BinnedLeaves::wait(BinnedLeaf& leaf) {
  if (!leaf.histogram) {
    return;
  }
  const std::ptrdiff_t size = std::ssize(leaf.histogram->grams);
  if (size <= memory_left_) {
    memory_left_ -= size;
  } else {
    leaf.histogram.reset();
  }
}

std::array<BinnedLeaf, 2> BinnedLeaves::divide(BinnedLeaf& leaf, const SplitCandidate& split) {
  const std::size_t input = static_cast<std::size_t>(split.input);
  const std::vector<std::uint8_t>& codes = bins_[input].codes;
  std::array<bool, most_bins> goes_left{};
  for (std::size_t code = 0; code < goes_left.size(); ++code) {
    goes_left[code] = data_.num_levels[input] > 0 ? code < split.level_side.size() && split.level_side[code] < 0
                                                  : static_cast<int>(code) <= split.bin;
  }
  std::array<BinnedLeaf, 2> children;
  children[0].rows.resize(static_cast<std::size_t>(split.left));
  children[1].rows.resize(leaf.rows.size() - static_cast<std::size_t>(split.left));
  std::array<int*, 2> next = {children[1].rows.data(), children[0].rows.data()};
  for (const int row : leaf.rows) {
    *next[goes_left[codes[static_cast<std::size_t>(row)]] ? 1 : 0]++ = row;
  }
  for (BinnedLeaf& child : children) {
    child.value = leaf.value;
    child.slope = leaf.slope;
  }
  if (leaf.histogram) {
    memory_left_ += std::ssize(leaf.histogram->grams);
    const std::size_t small = children[0].rows.size() <= children[1].rows.size() ? 0 : 1;
    children[small].histogram = accumulate(children[small].rows);
    const Histogram& less = *children[small].histogram;
    for (std::size_t k = 0; k < less.grams.size(); ++k) {
      leaf.histogram->grams[k] -= less.grams[k];
    }
    for (std::size_t bin = 0; bin < less.counts.size(); ++bin) {
      leaf.histogram->counts[bin] -= less.counts[bin];
    }
    children[1 - small].histogram = std::move(leaf.histogram);
  }
  return children;
}

double BinnedLeaves::threshold(const BinnedLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                               const Node& right) const {
  const std::size_t input = static_cast<std::size_t>(split.input);
  double low = -std::numeric_limits<double>::infinity();
  double high = -low;
  for (const int row : leaf.rows) {
    const double value = data_.split_value(row, split.input);
    if (static_cast<int>(bins_[input].codes[static_cast<std::size_t>(row)]) <= split.bin) {
      low = std::max(low, value);
    } else {
      high = std::min(high, value);
    }
  }
  // The regression of the children's difference on the split input over the node's rows follows from the regressors'
  // covariance if the input is one of them.
  const TrainingRows& training = data_.training;
  const int column = data_.problem.options.split_inputs[input];
  const auto regressor = std::find_if(training.regressors.begin(), training.regressors.end(),
                                      [&](const Regressor& each) { return each.input == column && each.level < 0; });
  const std::ptrdiff_t outputs = left.value.size();
  if (regressor == training.regressors.end()) {
    return data_.place_threshold(low, high, low, Eigen::VectorXd::Zero(outputs), Eigen::VectorXd::Zero(outputs));
  }
  const std::ptrdiff_t k = regressor - training.regressors.begin();
  const Eigen::MatrixXd slopes = (right.slope - left.slope) * training.scale.asDiagonal();
  const Eigen::VectorXd apart = right.value - left.value + slopes * leaf.mean;
  const double variance = leaf.covariance(k, k);
  const Eigen::VectorXd slope = variance > 0.0
                                    ? Eigen::VectorXd(slopes * leaf.covariance.col(k) / (variance * training.scale(k)))
                                    : Eigen::VectorXd::Zero(outputs);
  return data_.place_threshold(low, high, regressor->centre + node.mean(k), apart, slope);
}

}  // namespace llmt
