#include "stream/search.hpp"

#include <algorithm>
#include <cmath>

#include "base/between.hpp"
#include "numerics/f_distribution.hpp"

namespace llmt {
namespace {

// The next test is due when the number of rows has grown by this factor.
constexpr double test_growth = 1.25;

// A split that passes waits until it beats the best one on any other input by a standard error of the difference (T.2),
// or until the number of rows has grown by this factor since it passed first. The first split that is better than none
// is often not the best one, and all later splits below it depend on it.
constexpr double patience_with_rivals = 2.0;

// Doubles that are prefetched at a time: one line of the cache.
constexpr Eigen::Index cache_line = 8;

}  // namespace

LeafSearch::LeafSearch(const StreamSetting& setting)
    : setting_(setting),
      residuals_(setting.shape, Eigen::VectorXd::Ones(1)),
      bins_(setting.inputs),
      next_test_(std::max(rows_before_bins, 2 * setting.min_leaf_samples)) {}

void LeafSearch::set_edges(Bins& bins, std::vector<double> edges) const {
  bins.edges = std::move(edges);
  bins.grams.assign((bins.edges.size() + 1) * setting_.shape.size(), 0.0);
  bins.rows.assign(bins.edges.size() + 1, 0);
}

// Edges halfway between neighbouring values at the quantiles of the first rows.
std::vector<double> LeafSearch::edges_of_first_rows(Eigen::Index input) const {
  const Eigen::Index stride = setting_.inputs + 2;
  const Eigen::Index count = std::ssize(first_rows_) / stride;
  std::vector<double> values;
  for (Eigen::Index i = 0; i < count; ++i) {
    const double value = first_rows_[i * stride + input];
    if (!std::isnan(value)) values.push_back(value);
  }
  std::ranges::sort(values);
  std::vector<double> edges;
  for (int b = 1; b < setting_.bins && !values.empty(); ++b) {
    const std::size_t at = b * values.size() / setting_.bins;
    const auto above = std::ranges::upper_bound(values, values[at > 0 ? at - 1 : 0]);
    if (above == values.end()) continue;
    const double edge = between(*(above - 1), *above);
    if (edges.empty() || edge > edges.back()) edges.push_back(edge);
  }
  return edges;
}

// Lays out the bins and puts the first rows into them.
void LeafSearch::lay_out(const Basis& basis) {
  const Eigen::Index stride = setting_.inputs + 2;
  const Eigen::Index count = std::ssize(first_rows_) / stride;
  for (Eigen::Index j = 0; j < setting_.inputs; ++j) {
    set_edges(bins_[j], edges_of_first_rows(j));
  }
  RowProducts products(setting_.shape);
  std::vector<double> kept = std::move(first_rows_);
  first_rows_ = {};
  laid_out_ = true;
  Eigen::VectorXd z(setting_.inputs);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double* row = kept.data() + i * stride;
    for (Eigen::Index j = 0; j < setting_.inputs; ++j) {
      z(j) = setting_.scaled(j, row[j]);
    }
    const StreamRow first{row, z.data(), row[setting_.inputs], row[setting_.inputs + 1], 1.0};
    products.set(basis, first.z, first.y, first.weight);
    put(first, products);
  }
}

void LeafSearch::put(const StreamRow& row, const RowProducts& products) {
  const Eigen::Index size = setting_.shape.size();
  // The sums of all leaves do not fit into a cache, so they are prefetched before they are needed.
  sums_of_row_.clear();
  for (Eigen::Index j = 0; j < setting_.inputs; ++j) {
    Bins& bins = bins_[j];
    if (std::isnan(row.x[j]) || bins.edges.empty()) continue;
    const auto edge = std::ranges::lower_bound(bins.edges, row.x[j]);
    const Eigen::Index bin = edge - bins.edges.begin();
    double* const sums = bins.grams.data() + bin * size;
    for (Eigen::Index k = 0; k < size; k += cache_line) {
      __builtin_prefetch(sums + k, 1);
    }
    sums_of_row_.push_back(sums);
    ++bins.rows[bin];
  }
  for (double* const sums : sums_of_row_) {
    products.add_to(sums);
  }
}

void LeafSearch::add(const StreamRow& row, const Basis& basis, const RowProducts& products) {
  ++rows_;
  if (laid_out_) {
    put(row, products);
    return;
  }
  first_rows_.insert(first_rows_.end(), row.x, row.x + setting_.inputs);
  first_rows_.push_back(row.y);
  first_rows_.push_back(row.weight);
  if (rows_ == rows_before_bins) {
    lay_out(basis);
  }
}

Sums LeafSearch::side(const Bins& bins, std::size_t begin, std::size_t end) const {
  const std::size_t size = setting_.shape.size();
  Sums sums{std::vector<double>(size, 0.0), 0};
  for (std::size_t b = begin; b < end; ++b) {
    llmt::add(setting_.shape, bins.grams.data() + b * size, sums.gram.data());
    sums.rows += bins.rows[b];
  }
  return sums;
}

LeafSearch::Edges LeafSearch::edges(int input) {
  const Bins& bins = bins_[input];
  Edges result;
  result.thresholds = bins.edges;
  const std::size_t count = bins.edges.size();
  if (count == 0) return result;
  const std::size_t size = setting_.shape.size();
  std::vector<const double*> parts;
  for (std::size_t bin = 0; bin <= count; ++bin) {
    parts.push_back(bins.grams.data() + bin * size);
    result.rows += bins.rows[bin];
    if (bin < count) result.rows_left.push_back(result.rows);
  }
  result.sum(setting_.shape, parts);
  result.evaluate(residuals_);
  std::vector<double> all(result.left.end() - setting_.shape.size(), result.left.end());
  llmt::add(setting_.shape, parts.back(), all.data());
  const double* const gram = all.data();
  residuals_.evaluate(&gram, 1, &result.rss, &result.rank);
  return result;
}

// The best edge of an input, if it has an admissible one.
LeafSearch::Found LeafSearch::look_at(int input) {
  const Edges all = edges(input);
  const double rows = static_cast<double>(all.rows);
  Found found;
  if (!(all.rss > rows * setting_.rounding * setting_.rounding)) {
    return found;  // one model fits exactly
  }
  for (std::size_t e = 0; e < all.thresholds.size(); ++e) {
    if (different_ * static_cast<double>(std::min(all.rows_left[e], all.rows - all.rows_left[e])) <
        static_cast<double>(setting_.min_leaf_samples)) {
      continue;
    }
    ++found.tested;
    const double ratio = (all.rss_left[e] + all.rss_right[e]) / all.rss;
    if (found.input < 0 || ratio < found.ratio) {
      found = {input, e, ratio, all.rss, all.rank, all.rank_left[e], all.rank_right[e], rows, found.tested};
    }
  }
  return found;
}

bool LeafSearch::passes(const Found& found) const {
  const double added = found.rank_left + found.rank_right - found.rank;
  const double freedom = different_ * found.rows - found.rank_left - found.rank_right;
  if (added <= 0.0 || freedom <= 0.0) return false;
  // In units of the residual sum of squares of one model.
  const double p_value = chow_p_value(1.0 - found.ratio, added, found.ratio / freedom, freedom);
  const double tests = tests_ * (tests_ + 1.0);
  if (!(p_value * found.tested * tests < setting_.significance)) return false;
  const double before = different_ * found.rss / (different_ * found.rows - found.rank);
  const double after = different_ * found.rss * found.ratio / freedom;
  return before - after >= setting_.min_variance_gain * setting_.output_variance;
}

std::optional<StreamSplit> LeafSearch::test(const Eigen::VectorXd& low, const Eigen::VectorXd& high, double different) {
  different_ = different;
  if (rows_ < next_test_) return std::nullopt;
  next_test_ = rows_ + std::max(setting_.coefficients(),
                                static_cast<Eigen::Index>((test_growth - 1.0) * static_cast<double>(rows_)));
  ++tests_;
  Found found;
  double rival = 1.0;  // ratio of the best split on another input
  for (int j = 0; j < setting_.inputs; ++j) {
    const Found of_input = look_at(j);
    const double tested = found.tested + of_input.tested;
    if (of_input.input >= 0 && (found.input < 0 || of_input.ratio < found.ratio)) {
      rival = found.input < 0 ? 1.0 : found.ratio;
      found = of_input;
    } else if (of_input.input >= 0) {
      rival = std::min(rival, of_input.ratio);
    }
    found.tested = tested;
  }
  if (found.input >= 0 && passes(found)) {
    first_passed_ = first_passed_ > 0 ? first_passed_ : rows_;
    const double n = different_ * found.rows;
    // Squared residuals of two fits differ by 2 e (f_1 - f_2), about, and the fits by what both gain.
    const double scatter = 2.0 * std::sqrt(found.ratio * (2.0 - found.ratio - rival) / n);
    if (rival - found.ratio > scatter ||
        static_cast<double>(rows_) >= patience_with_rivals * static_cast<double>(first_passed_)) {
      return split_at(found, low, high);
    }
  }
  return std::nullopt;
}

StreamSplit LeafSearch::split_at(const Found& found, const Eigen::VectorXd& low, const Eigen::VectorXd& high) const {
  const Bins& bins = bins_[found.input];
  const double edge = bins.edges[found.edge];
  const double before = found.edge > 0 ? bins.edges[found.edge - 1] : low(found.input);
  const double behind = found.edge + 1 < bins.edges.size() ? bins.edges[found.edge + 1] : high(found.input);
  return {found.input,
          edge,
          std::max(edge - before, behind - edge),
          side(bins, 0, found.edge + 1),
          side(bins, found.edge + 1, bins.edges.size() + 1),
          found.rss * (1.0 - found.ratio) / found.rows};
}

Eigen::Index LeafSearch::bytes() const {
  std::size_t doubles = first_rows_.capacity();
  for (const Bins& bins : bins_) {
    doubles += bins.grams.capacity() + bins.edges.capacity() + bins.rows.capacity();
  }
  return static_cast<Eigen::Index>(sizeof(LeafSearch) + doubles * sizeof(double));
}

}  // namespace llmt
