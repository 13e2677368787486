#include "stream/search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "numerics/f_distribution.hpp"

namespace llmt {
namespace {

/// Rows whose quantiles are the first edges.
constexpr std::ptrdiff_t first_rows = 64;

/// Tests come when rows have grown by this factor.
constexpr double test_growth = 1.25;

/// A split that passes still waits until it beats the best one on another input by a standard error of the difference,
/// or rows have grown by this factor since it passed first: the first split that is better than none is often not the
/// right one, and what is below it depends on it.
constexpr double patience_with_rivals = 2.0;

double student_p_value(double t, double freedom) { return freedom > 0.0 ? f_survival(t * t, 1.0, freedom) : 1.0; }

}  // namespace

LeafSearch::LeafSearch(const StreamSetting& setting)
    : setting_(setting),
      residuals_(setting.shape, Eigen::VectorXd::Ones(1)),
      bins_(static_cast<std::size_t>(setting.inputs)),
      next_test_(std::max(first_rows, 2 * setting.options.min_leaf_samples)) {
  if (setting.options.rule == StreamRule::ra) {
    for (SignSums& sums : signs_) {
      const Eigen::ArrayXd zero = Eigen::ArrayXd::Zero(setting.inputs);
      sums = {zero, zero, zero, zero, zero};
    }
  }
}

void LeafSearch::set_edges(Bins& bins, std::vector<double> edges) const {
  bins.edges = std::move(edges);
  bins.grams.assign((bins.edges.size() + 1) * static_cast<std::size_t>(setting_.shape.size()), 0.0);
  bins.rows.assign(bins.edges.size() + 1, 0);
}

/// Edges halfway between neighbouring values at the quantiles of the first rows.
void LeafSearch::lay_out(const Basis& basis) {
  const std::ptrdiff_t stride = setting_.inputs + 2;
  const std::ptrdiff_t count = std::ssize(first_rows_) / stride;
  for (std::ptrdiff_t j = 0; j < setting_.inputs; ++j) {
    std::vector<double> values;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      if (const double value = first_rows_[static_cast<std::size_t>(i * stride + j)]; !std::isnan(value)) {
        values.push_back(value);
      }
    }
    std::sort(values.begin(), values.end());
    std::vector<double> edges;
    for (int b = 1; b < setting_.options.bins && !values.empty(); ++b) {
      const std::size_t at =
          static_cast<std::size_t>(b) * values.size() / static_cast<std::size_t>(setting_.options.bins);
      const auto above = std::upper_bound(values.begin(), values.end(), values[at > 0 ? at - 1 : 0]);
      if (above != values.end()) {
        const double edge = *(above - 1) + 0.5 * (*above - *(above - 1));
        if (edges.empty() || edge > edges.back()) {
          edges.push_back(edge);
        }
      }
    }
    set_edges(bins_[static_cast<std::size_t>(j)], std::move(edges));
  }
  RowProducts products(setting_.shape);
  std::vector<double> kept = std::move(first_rows_);
  first_rows_ = {};
  laid_out_ = true;
  Eigen::VectorXd z(setting_.inputs);
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const double* row = kept.data() + i * stride;
    for (std::ptrdiff_t j = 0; j < setting_.inputs; ++j) {
      z(j) = setting_.scaled(j, row[j]);
    }
    const StreamRow first{row, z.data(), row[setting_.inputs], row[setting_.inputs + 1], 1.0};
    products.set(basis, first.z, first.y, first.weight);
    put(first, products);
  }
}

void LeafSearch::put(const StreamRow& row, const RowProducts& products) {
  const std::ptrdiff_t size = setting_.shape.size();
  const std::ptrdiff_t begin = setting_.options.rule == StreamRule::ra ? std::max(0, proposed_) : 0;
  const std::ptrdiff_t end = setting_.options.rule == StreamRule::ra ? proposed_ + 1 : setting_.inputs;
  // The sums of all leaves do not fit into a cache: they are asked for before they are needed.
  sums_of_row_.clear();
  for (std::ptrdiff_t j = begin; j < end; ++j) {
    Bins& bins = bins_[static_cast<std::size_t>(j)];
    if (std::isnan(row.x[j]) || bins.edges.empty()) {
      continue;
    }
    const auto edge = std::lower_bound(bins.edges.begin(), bins.edges.end(), row.x[j]);
    const std::ptrdiff_t bin = edge - bins.edges.begin();
    double* const sums = bins.grams.data() + bin * size;
    for (std::ptrdiff_t k = 0; k < size; k += 8) {
      __builtin_prefetch(sums + k, 1);
    }
    sums_of_row_.push_back(sums);
    ++bins.rows[static_cast<std::size_t>(bin)];
  }
  for (double* const sums : sums_of_row_) {
    products.add_to(sums);
  }
  proposed_rows_ += proposed_ >= 0 ? 1 : 0;
}

void LeafSearch::add_signs(const StreamRow& row, double error) {
  SignSums& sums = signs_[error >= 0.0 ? 1 : 0];
  for (std::ptrdiff_t j = 0; j < setting_.inputs; ++j) {
    const double value = row.z[j];
    if (std::isnan(value)) {
      continue;
    }
    sums.count(j) += 1.0;
    const double before = value - sums.mean(j);
    sums.mean(j) += before / sums.count(j);
    sums.squares(j) += before * (value - sums.mean(j));
    // About the mean as it is now: for rows of an unchanging leaf that is soon as good as the final one.
    const double spread = std::abs(value - sums.mean(j));
    sums.spread(j) += spread;
    sums.spread_squares(j) += spread * spread;
  }
}

void LeafSearch::add(const StreamRow& row, const Basis& basis, const RowProducts& products, double error) {
  ++rows_;
  if (setting_.options.rule == StreamRule::ra) {
    if (proposed_ < 0) {
      add_signs(row, error);
    } else {
      put(row, products);
    }
    return;
  }
  if (laid_out_) {
    put(row, products);
    return;
  }
  first_rows_.insert(first_rows_.end(), row.x, row.x + setting_.inputs);
  first_rows_.push_back(row.y);
  first_rows_.push_back(row.weight);
  if (rows_ == first_rows) {
    lay_out(basis);
  }
}

Sums LeafSearch::side(const Bins& bins, std::size_t begin, std::size_t end) const {
  const std::size_t size = static_cast<std::size_t>(setting_.shape.size());
  Sums sums{std::vector<double>(size, 0.0), 0};
  for (std::size_t b = begin; b < end; ++b) {
    llmt::add(setting_.shape, bins.grams.data() + b * size, sums.gram.data());
    sums.rows += bins.rows[b];
  }
  return sums;
}

LeafSearch::Edges LeafSearch::edges(int input) {
  const Bins& bins = bins_[static_cast<std::size_t>(input)];
  Edges result;
  result.thresholds = bins.edges;
  const std::size_t count = bins.edges.size();
  if (count == 0) {
    return result;
  }
  const std::size_t size = static_cast<std::size_t>(setting_.shape.size());
  // Left of each edge, then right of it, then all.
  std::vector<double> grams((2 * count + 1) * size, 0.0);
  for (std::size_t e = 0; e < count; ++e) {
    double* const sum = grams.data() + e * size;
    std::copy_n(e > 0 ? sum - size : sum, size, sum);
    llmt::add(setting_.shape, bins.grams.data() + e * size, sum);
    result.rows += bins.rows[e];
    result.rows_left.push_back(result.rows);
  }
  result.rows += bins.rows[count];
  for (std::size_t e = count; e-- > 0;) {
    double* const sum = grams.data() + (count + e) * size;
    std::copy_n(e + 1 < count ? sum + size : sum, size, sum);
    llmt::add(setting_.shape, bins.grams.data() + (e + 1) * size, sum);
  }
  std::copy_n(grams.data() + (count - 1) * size, size, grams.data() + 2 * count * size);
  llmt::add(setting_.shape, bins.grams.data() + count * size, grams.data() + 2 * count * size);
  std::vector<const double*> pointers;
  for (std::size_t k = 0; k <= 2 * count; ++k) {
    pointers.push_back(grams.data() + k * size);
  }
  std::vector<double> rss(pointers.size());
  std::vector<int> rank(pointers.size());
  residuals_.evaluate(pointers.data(), std::ssize(pointers), rss.data(), rank.data());
  const std::ptrdiff_t edge_count = std::ssize(bins.edges);
  result.rss_left.assign(rss.begin(), rss.begin() + edge_count);
  result.rss_right.assign(rss.begin() + edge_count, rss.end() - 1);
  result.rank_left.assign(rank.begin(), rank.begin() + edge_count);
  result.rank_right.assign(rank.begin() + edge_count, rank.end() - 1);
  result.rss = rss.back();
  result.rank = rank.back();
  return result;
}

/// The best edge of an input, if it has an admissible one.
LeafSearch::Found LeafSearch::look_at(int input) {
  const Edges all = edges(input);
  Found found;
  if (!(all.rss > static_cast<double>(all.rows) * setting_.rounding * setting_.rounding)) {
    return found;  // one model fits exactly
  }
  for (std::size_t e = 0; e < all.thresholds.size(); ++e) {
    if (different_ * static_cast<double>(std::min(all.rows_left[e], all.rows - all.rows_left[e])) <
        static_cast<double>(setting_.options.min_leaf_samples)) {
      continue;
    }
    ++found.tested;
    const double ratio = (all.rss_left[e] + all.rss_right[e]) / all.rss;
    if (found.input < 0 || ratio < found.ratio) {
      found = {input, e, ratio, all.rss, all.rank, all.rank_left[e], all.rank_right[e], all.rows, found.tested};
    }
  }
  return found;
}

bool LeafSearch::passes(const Found& found) const {
  const double added = found.rank_left + found.rank_right - found.rank;
  const double freedom = different_ * static_cast<double>(found.rows) - found.rank_left - found.rank_right;
  if (added <= 0.0 || freedom <= 0.0) {
    return false;
  }
  const double f = found.ratio > 0.0 ? ((1.0 - found.ratio) / added) / (found.ratio / freedom)
                                     : std::numeric_limits<double>::infinity();
  const double tests = static_cast<double>(tests_) * static_cast<double>(tests_ + 1);
  if (!(f_survival(f, added, freedom) * static_cast<double>(found.tested) * tests < setting_.options.significance)) {
    return false;
  }
  const double before = different_ * found.rss / (different_ * static_cast<double>(found.rows) - found.rank);
  const double after = different_ * found.rss * found.ratio / freedom;
  return before - after >= setting_.options.min_variance_gain * setting_.output_variance;
}

std::optional<StreamSplit> LeafSearch::test(const Eigen::VectorXd& low, const Eigen::VectorXd& high, double different) {
  different_ = different;
  if (rows_ < next_test_) {
    return std::nullopt;
  }
  next_test_ =
      rows_ + std::max(setting_.coefficients(),
                       static_cast<std::ptrdiff_t>((test_growth - 1.0) *
                                                   static_cast<double>(proposed_ >= 0 ? proposed_rows_ : rows_)));
  ++tests_;
  if (setting_.options.rule == StreamRule::ra && proposed_ < 0) {
    propose();
    return std::nullopt;
  }
  Found found;
  double rival = 1.0;  // ratio of the best split on another input
  for (int j = 0; j < setting_.inputs; ++j) {
    if (proposed_ < 0 || proposed_ == j) {
      const Found of_input = look_at(j);
      const std::ptrdiff_t tested = found.tested + of_input.tested;
      if (of_input.input >= 0 && (found.input < 0 || of_input.ratio < found.ratio)) {
        rival = found.input < 0 ? 1.0 : found.ratio;
        found = of_input;
      } else if (of_input.input >= 0) {
        rival = std::min(rival, of_input.ratio);
      }
      found.tested = tested;
    }
  }
  if (found.input >= 0 && passes(found)) {
    first_passed_ = first_passed_ > 0 ? first_passed_ : rows_;
    const double n = different_ * static_cast<double>(found.rows);
    // Squared residuals of two fits differ by 2 e (f_1 - f_2), about, and the fits by what both gain.
    const double scatter = 2.0 * std::sqrt(found.ratio * (2.0 - found.ratio - rival) / n);
    if (proposed_ >= 0 || rival - found.ratio > scatter ||
        static_cast<double>(rows_) >= patience_with_rivals * static_cast<double>(first_passed_)) {
      return split_at(found, low, high);
    }
  }
  if (proposed_ >= 0 && proposed_rows_ >= patience_) {
    proposed_ = -1;
  }
  return std::nullopt;
}

StreamSplit LeafSearch::split_at(const Found& found, const Eigen::VectorXd& low, const Eigen::VectorXd& high) const {
  const Bins& bins = bins_[static_cast<std::size_t>(found.input)];
  const double edge = bins.edges[found.edge];
  const double before = found.edge > 0 ? bins.edges[found.edge - 1] : low(found.input);
  const double behind = found.edge + 1 < bins.edges.size() ? bins.edges[found.edge + 1] : high(found.input);
  return {found.input,
          edge,
          std::max(edge - before, behind - edge),
          side(bins, 0, found.edge + 1),
          side(bins, found.edge + 1, bins.edges.size() + 1),
          found.rss * (1.0 - found.ratio) / static_cast<double>(found.rows)};
}

/// Residual analysis: the input whose mean or scatter differs most between the rows above and below the model, if
/// significantly, is tried, halfway between the means.
bool LeafSearch::propose() {
  const double tests = static_cast<double>(tests_) * static_cast<double>(tests_ + 1);
  const double allowed = setting_.options.significance / (2.0 * static_cast<double>(setting_.inputs) * tests);
  double smallest = 1.0;
  std::ptrdiff_t input = -1;
  for (std::ptrdiff_t j = 0; j < setting_.inputs; ++j) {
    const double n0 = signs_[0].count(j);
    const double n1 = signs_[1].count(j);
    if (std::min(n0, n1) < 2.0) {
      continue;
    }
    const double freedom = different_ * (n0 + n1) - 2.0;
    if (freedom <= 0.0) {
      continue;
    }
    const auto p_value = [&](double difference, double squares) {
      const double variance = squares / freedom * (1.0 / n0 + 1.0 / n1);
      return variance > 0.0 ? student_p_value(difference / std::sqrt(variance), freedom) : 1.0;
    };
    const double of_means = p_value(signs_[1].mean(j) - signs_[0].mean(j), signs_[0].squares(j) + signs_[1].squares(j));
    const double spread0 = signs_[0].spread(j) / n0;
    const double spread1 = signs_[1].spread(j) / n1;
    const double of_spreads = p_value(spread1 - spread0, signs_[0].spread_squares(j) - n0 * spread0 * spread0 +
                                                             signs_[1].spread_squares(j) - n1 * spread1 * spread1);
    if (const double p = std::min(of_means, of_spreads); p < smallest) {
      smallest = p;
      input = j;
    }
  }
  if (input < 0 || !(smallest < allowed)) {
    return false;
  }
  const double z = 0.5 * (signs_[0].mean(input) + signs_[1].mean(input));
  set_edges(bins_[static_cast<std::size_t>(input)], {setting_.unscaled(input, z)});
  proposed_ = static_cast<int>(input);
  proposed_rows_ = 0;
  patience_ = std::max(rows_, 4 * setting_.options.min_leaf_samples);
  next_test_ = rows_ + 2 * setting_.options.min_leaf_samples;
  return true;
}

std::ptrdiff_t LeafSearch::bytes() const {
  std::size_t doubles = first_rows_.capacity() + 10 * static_cast<std::size_t>(signs_[0].count.size());
  for (const Bins& bins : bins_) {
    doubles += bins.grams.capacity() + bins.edges.capacity() + bins.rows.capacity();
  }
  return static_cast<std::ptrdiff_t>(sizeof(LeafSearch) + doubles * sizeof(double));
}

}  // namespace llmt
