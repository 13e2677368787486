#include "spread/fit_spread.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "llmt/random.hpp"

namespace llmt {
namespace {

constexpr int most_leaves = 16;
constexpr int fewest_rows_of_leaf = 20;
// A split must lower the sum of squares by this many variances: what the best of many thresholds reaches by chance.
constexpr double least_gain = 8.0;
// Rows with whose weight a leaf is drawn towards its parent, and a level towards those with as few rows.
constexpr double prior_rows = 10.0;
// The smallest spread as part of the mean, and what is added to errors before their logarithm.
constexpr double floor_of_errors = 0.05;
constexpr std::size_t most_bins = 32;

// A column by bins of about as many rows; its last bin is that of missing values.
struct Column {
  std::vector<double> thresholds;  // between bin k and k + 1
  std::vector<std::uint8_t> bins;  // of each row

  std::size_t missing() const { return thresholds.size() + 1; }
};

Column binned(const std::vector<double>& values) {
  std::vector<double> sorted;
  std::ranges::copy_if(values, std::back_inserter(sorted), [](double value) { return !std::isnan(value); });
  std::ranges::sort(sorted);
  Column column;
  for (std::size_t k = 1; k < most_bins && !sorted.empty(); ++k) {
    const std::size_t at = k * sorted.size() / most_bins;
    const auto above = std::upper_bound(sorted.begin(), sorted.end(), sorted[at]);
    if (above == sorted.end()) break;
    const double threshold = std::midpoint(sorted[at], *above);
    const double kept = threshold < *above ? threshold : sorted[at];
    if (column.thresholds.empty() || kept > column.thresholds.back()) column.thresholds.push_back(kept);
  }
  for (const double value : values) {
    const auto bin = std::ranges::lower_bound(column.thresholds, value) - column.thresholds.begin();
    column.bins.push_back(static_cast<std::uint8_t>(std::isnan(value) ? column.missing() : bin));
  }
  return column;
}

// The number of rows and the sum of their values.
struct Sums {
  double rows = 0.0;
  double values = 0.0;

  Sums& operator+=(const Sums& other) {
    rows += other.rows;
    values += other.values;
    return *this;
  }
  Sums operator-(const Sums& other) const { return {rows - other.rows, values - other.values}; }
  double squares() const { return rows > 0.0 ? values * values / rows : 0.0; }
};

// Levels with about as many rows are one class: 0; 1 and 2; 3 to 6; 7 to 14; ...
std::size_t class_of(double count) { return static_cast<std::size_t>(std::log2(count + 1.0)); }

double drawn(const Sums& sums, double prior) { return (sums.values + prior_rows * prior) / (sums.rows + prior_rows); }

// The mean log error of each level, drawn towards that of levels with about as many rows, since new rows of a rare
// level err as those of other rare ones do. Last: that of a level without rows, which is as the rarest are.
std::vector<double> level_values(const std::vector<Sums>& of_level, const std::vector<double>& counts, double mean) {
  std::vector<Sums> of_class;
  const auto grown_to = [&](std::size_t which) -> Sums& {
    if (of_class.size() <= which) of_class.resize(which + 1);
    return of_class[which];
  };
  for (std::size_t level = 0; level < counts.size(); ++level) grown_to(class_of(counts[level])) += of_level[level];
  const auto rarest = std::ranges::find_if(of_class, [](const Sums& sums) { return sums.rows > 0.0; });
  const double of_rarest = rarest == of_class.end() ? mean : drawn(*rarest, mean);
  std::vector<double> values;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    const Sums& alike = of_class[class_of(counts[level])];
    values.push_back(drawn(of_level[level], alike.rows > 0.0 ? drawn(alike, mean) : of_rarest));
  }
  values.push_back(of_rarest);
  return values;
}

struct Split {
  double gain = 0.0;
  std::size_t column = 0;
  std::size_t last_left = 0;  // bin
  bool missing_left = false;
};

struct Leaf {
  std::vector<int> rows;
  Split best;
  double error = 0.0;  // mean absolute one, drawn towards the parent's
};

class Grower {
 public:
  // `rows`: those to learn from. `logs`, `errors`: of all rows.
  Grower(const std::vector<const Column*>& columns, const Eigen::VectorXd& logs, const Eigen::VectorXd& errors)
      : columns_(columns), logs_(logs), errors_(errors) {}

  std::vector<SpreadNode> grow(std::vector<int> rows) {
    const double mean = mean_error(rows);
    const double count = static_cast<double>(rows.size());
    nodes_.emplace_back();
    leaves_.push_back(leaf_of(std::move(rows), mean));
    const Sums all = sums_of(leaves_.front().rows);
    double within = -all.squares();
    for (const int row : leaves_.front().rows) within += logs_(row) * logs_(row);
    for (int made = 1; made < most_leaves; ++made) {
      const auto best = std::ranges::max_element(leaves_, {}, [](const Leaf& leaf) { return leaf.best.gain; });
      if (!(best->best.gain > least_gain * within / count)) break;
      within -= best->best.gain;
      split(best - leaves_.begin());
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (nodes_[i].is_leaf()) nodes_[i].factor = std::max(leaves_[i].error / mean, floor_of_errors);
    }
    return std::move(nodes_);
  }

 private:
  double mean_error(const std::vector<int>& rows) const { return errors_(rows).mean(); }

  Sums sums_of(const std::vector<int>& rows) const { return {static_cast<double>(rows.size()), logs_(rows).sum()}; }

  Leaf leaf_of(std::vector<int> rows, double of_parent) const {
    const double count = static_cast<double>(rows.size());
    const double error = drawn({count, count * mean_error(rows)}, of_parent);
    Leaf leaf{std::move(rows), {}, error};
    const Sums all = sums_of(leaf.rows);
    for (std::size_t column = 0; column < columns_.size(); ++column) search(leaf, all, column);
    return leaf;
  }

  void search(Leaf& leaf, const Sums& all, std::size_t column) const {
    const Column& binned = *columns_[column];
    std::vector<Sums> of_bin(binned.missing() + 1);
    for (const int row : leaf.rows) of_bin[binned.bins[row]] += {1.0, logs_(row)};
    const Sums missing = of_bin.back();
    const auto consider = [&](const Sums& left, std::size_t last_left, bool missing_left) {
      const Sums right = all - left;
      if (std::min(left.rows, right.rows) < fewest_rows_of_leaf) return;
      const double gain = left.squares() + right.squares() - all.squares();
      if (gain > leaf.best.gain) leaf.best = {gain, column, last_left, missing_left};
    };
    const Sums present = all - missing;
    Sums left;
    for (std::size_t bin = 0; bin < binned.thresholds.size(); ++bin) {
      left += of_bin[bin];
      if (missing.rows == 0.0) {
        consider(left, bin, 2.0 * left.rows >= all.rows);  // the side of most rows
      } else {
        consider(left, bin, false);
        Sums with = left;
        with += missing;
        consider(with, bin, true);
      }
    }
    if (missing.rows > 0.0) consider(present, binned.thresholds.size(), false);
  }

  void split(std::ptrdiff_t at) {
    const Split best = leaves_[at].best;
    const Column& column = *columns_[best.column];
    std::vector<int> left;
    std::vector<int> right;
    for (const int row : leaves_[at].rows) {
      const std::size_t bin = column.bins[row];
      const bool is_left = bin == column.missing() ? best.missing_left : bin <= best.last_left;
      (is_left ? left : right).push_back(row);
    }
    SpreadNode& node = nodes_[at];
    node.column = static_cast<int>(best.column);
    // Beyond the last threshold lie the missing values alone.
    node.threshold = best.last_left < column.thresholds.size() ? column.thresholds[best.last_left]
                                                               : std::numeric_limits<double>::max();
    node.missing_left = best.missing_left;
    node.left = static_cast<int>(nodes_.size());
    node.right = node.left + 1;
    const double of_parent = leaves_[at].error;
    leaves_[at] = {};
    leaves_.push_back(leaf_of(std::move(left), of_parent));
    leaves_.push_back(leaf_of(std::move(right), of_parent));
    nodes_.resize(nodes_.size() + 2);
  }

  const std::vector<const Column*>& columns_;
  const Eigen::VectorXd& logs_;
  const Eigen::VectorXd& errors_;
  std::vector<SpreadNode> nodes_;
  std::vector<Leaf> leaves_;  // one a node; empty where that is a split
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Of all errors, with a part of the median of those that are learnt from added.
Eigen::VectorXd logs_of(const Eigen::VectorXd& all, const std::vector<int>& learnt) {
  const Eigen::VectorXd errors = all(learnt);
  const double middle = median({errors.begin(), errors.end()});
  return (all.array() + floor_of_errors * (middle > 0.0 ? middle : errors.mean())).log();
}

Eigen::VectorXd factors_of_weights(const Spread& spread, const Eigen::VectorXd& weights) {
  return weights.unaryExpr([&](double weight) { return factor_of_weight(spread, weight); });
}

// A spread without nodes whose share of noise leaves the logarithms of the errors alike: with the smallest variance.
Spread spread_of_weights(const ErrorRows& rows, const std::vector<int>& learnt) {
  Spread best;
  if (rows.weights.size() == 0) return best;
  const Eigen::VectorXd weights = rows.weights(learnt);
  best.usual_weight = median({weights.begin(), weights.end()});
  const Eigen::VectorXd logs = logs_of(rows.errors, learnt)(learnt);
  double smallest = std::numeric_limits<double>::infinity();
  constexpr int steps = 20;
  for (int k = 0; k <= steps; ++k) {
    const double noise = k * k;  // finest near 0 and 1, where one of the two terms is small
    const double rest = (steps - k) * (steps - k);
    Spread spread = best;
    spread.noise_share = noise / (noise + rest);
    const Eigen::ArrayXd left = logs.array() - factors_of_weights(spread, weights).array().log();
    const double squares = (left - left.mean()).square().sum();
    if (squares < smallest * (1.0 - 1e-9)) {  // equal weights leave the share at 0
      smallest = squares;
      best = spread;
    }
  }
  return best;
}

// What a spread is learnt from, but for the values of levels, which depend on the rows that are learnt from.
class SpreadFit {
 public:
  explicit SpreadFit(const ErrorRows& rows) : rows_(rows), counts_(rows.columns.size()) {
    for (std::size_t j = 0; j < rows.columns.size(); ++j) {
      if (rows.columns[j].is_categorical()) {
        columns_.emplace_back();
        counts_[j].resize(rows.columns[j].levels.size(), 0.0);
        for (Eigen::Index row = 0; row < rows_.errors.size(); ++row) {
          if (const auto level = level_at(row, j)) ++counts_[j][*level];
        }
      } else {
        const auto values = rows.inputs.col(static_cast<Eigen::Index>(j));
        columns_.push_back(binned({values.begin(), values.end()}));
      }
    }
    columns_.push_back(binned({rows.predictions.begin(), rows.predictions.end()}));
  }

  // Adds to `spread` what the errors, which its factors of weight have been taken out of, say.
  Spread learnt_from(std::vector<int> learnt, const Eigen::VectorXd& errors, Spread spread) const {
    const Spread without_nodes = spread;
    std::vector<Column> of_levels(counts_.size());
    std::vector<const Column*> columns;
    const Eigen::VectorXd logs = logs_of(errors, learnt);
    const double mean = logs(learnt).mean();
    for (std::size_t j = 0; j < counts_.size(); ++j) {
      columns.push_back(counts_[j].empty() ? &columns_[j] : &of_levels[j]);
      if (counts_[j].empty()) {
        spread.levels.emplace_back();
        continue;
      }
      std::vector<Sums> sums(counts_[j].size());
      for (const int row : learnt) {
        if (const auto level = level_at(row, j)) sums[*level] += {1.0, logs(row)};
      }
      const std::vector<double>& values = spread.levels.emplace_back(level_values(sums, counts_[j], mean));
      std::vector<double> of_rows;
      for (Eigen::Index row = 0; row < rows_.errors.size(); ++row) {
        const auto level = level_at(row, j);
        of_rows.push_back(level ? values[*level] : values.back());
      }
      of_levels[j] = binned(of_rows);
    }
    columns.push_back(&columns_.back());
    spread.nodes = Grower(columns, logs, errors).grow(std::move(learnt));
    return spread.nodes.size() == 1 ? without_nodes : spread;
  }

 private:
  std::optional<std::size_t> level_at(Eigen::Index row, std::size_t input) const {
    const double value = rows_.inputs(row, static_cast<Eigen::Index>(input));
    const bool is_known = value >= 0.0 && value < static_cast<double>(rows_.columns[input].levels.size());
    return is_known ? std::optional(static_cast<std::size_t>(value)) : std::nullopt;
  }

  const ErrorRows& rows_;
  std::vector<std::vector<double>> counts_;  // rows of each level; empty for numbers
  std::vector<Column> columns_;              // inputs, and the prediction; empty for categories
};

}  // namespace

std::vector<Spread> fit_spreads(const ErrorRows& rows, const std::vector<int>& part, int parts) {
  std::vector<Spread> spreads(parts);
  if (parts < 2) return spreads;
  std::vector<std::vector<int>> others(parts);
  for (int p = 0; p < parts; ++p) {
    for (std::size_t row = 0; row < part.size(); ++row) {
      if (part[row] != p) others[p].push_back(static_cast<int>(row));
    }
    if (others[p].empty() || !(rows.errors(others[p]).maxCoeff() > 0.0)) return spreads;
  }
  for (int p = 0; p < parts; ++p) spreads[p] = spread_of_weights(rows, others[p]);
  if (rows.errors.size() < fewest_rows_of_spread) return spreads;
  const SpreadFit fit(rows);
  for (int p = 0; p < parts; ++p) {
    Eigen::VectorXd errors = rows.errors;
    if (spreads[p].noise_share > 0.0) {
      errors = errors.cwiseQuotient(factors_of_weights(spreads[p], rows.weights));
    }
    spreads[p] = fit.learnt_from(std::move(others[p]), errors, std::move(spreads[p]));
  }
  return spreads;
}

std::vector<int> dealt_parts(Eigen::Index rows, int parts) {
  std::vector<int> part;
  for (const Eigen::Index place : Random(1).permutation(rows)) part.push_back(static_cast<int>(place % parts));
  return part;
}

}  // namespace llmt
