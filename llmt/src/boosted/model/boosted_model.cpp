#include "llmt/boosted_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "base/checks.hpp"
#include "base/parallel.hpp"
#include "base/sum_over.hpp"
#include "boosted/model/boosted_checks.hpp"
#include "boosted/model/symmetric_table.hpp"
#include "boosted/model/transition.hpp"
#include "boosted/model/tree_walk.hpp"
#include "spread/scaled_residuals.hpp"

namespace llmt {
namespace {

// Calls itself where a row goes to both sides, so no deeper than Limit::model_splits_above_leaf.
double value_below(const BoostedTree& tree, const double* z, int at, double share) {
  double sum = 0.0;
  while (at >= 0) {
    const BoostedSplit& split = tree.splits[at];
    const double value = z[split.feature];
    if (std::isnan(value)) {
      const double left = split.missing_left;
      if (left > 0.0 && left < 1.0) {
        sum += value_below(tree, z, split.left, share * left);
        share *= 1.0 - left;
      }
      at = left == 1.0 ? split.left : split.right;
      continue;
    }
    if (std::abs(value - split.threshold) < split.half_width) {
      const double right = share_of_right(value, split.threshold, split.half_width);
      if (goes_both_ways(share, right, tree.smallest_share)) {
        sum += value_below(tree, z, split.left, share * (1.0 - right));
        share *= right;
        at = split.right;
        continue;
      }
    }
    at = value <= split.threshold ? split.left : split.right;
  }
  const BoostedLeaf& leaf = tree.leaves[-1 - at];
  double value = leaf.constant;
  for (std::size_t k = 0; k < leaf.features.size(); ++k) {
    const double of_feature = z[leaf.features[k]];
    if (!std::isnan(of_feature)) {
      value += leaf.slopes[k] * of_feature;
    } else if (!leaf.means.empty()) {
      value += leaf.slopes[k] * leaf.means[k];
    }
  }
  return sum + share * std::clamp(value, leaf.low, leaf.high);
}

void check_rows(const char* function, const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  if (inputs.cols() != model.num_inputs()) {
    throw std::invalid_argument(
        fmt::format("{}: inputs has {} columns, the model has {} inputs", function, inputs.cols(), model.num_inputs()));
  }
  check_finite_or_missing(function, "inputs", inputs);
}

// With fewer rows a table takes longer to make than it saves.
constexpr Eigen::Index enough_for_tables = 256;

std::vector<std::optional<SymmetricTable>> tables_of(const BoostedSum& sum, Eigen::Index rows) {
  std::vector<std::optional<SymmetricTable>> tables(sum.trees.size());
  if (rows < enough_for_tables) return tables;
  for (std::size_t k = 0; k < tables.size(); ++k) tables[k] = symmetric_table(sum.trees[k]);
  return tables;
}

// Of trees without a table.
std::vector<std::optional<TreeWalk>> walks_of(const BoostedSum& sum,
                                              const std::vector<std::optional<SymmetricTable>>& tables,
                                              Eigen::Index rows) {
  std::vector<std::optional<TreeWalk>> walks(sum.trees.size());
  if (rows < enough_for_tables) return walks;
  for (std::size_t k = 0; k < walks.size(); ++k) {
    if (!tables[k]) walks[k] = walk_of(sum.trees[k]);
  }
  return walks;
}

// Features that a row must have so that all tables and walks hold for it: without one of the others it goes to one
// side, or counts in the leaves as 0.
template <class OfTree>
void add_needed(const std::vector<std::optional<OfTree>>& trees, std::vector<int>& needed) {
  for (const std::optional<OfTree>& tree : trees) {
    if (tree) needed.insert(needed.end(), tree->needed.begin(), tree->needed.end());
  }
  std::ranges::sort(needed);
  const auto repeated = std::ranges::unique(needed);
  needed.erase(repeated.begin(), repeated.end());
}

void predict_by(const BoostedModel& model, const BoostedSum& sum, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                int max_threads, Eigen::Ref<Eigen::VectorXd> result) {
  const std::vector<std::optional<SymmetricTable>> tables = tables_of(sum, inputs.rows());
  const std::vector<std::optional<TreeWalk>> walks = walks_of(sum, tables, inputs.rows());
  const bool is_by_columns = inputs.rows() >= enough_for_tables;
  std::vector<int> needed;
  add_needed(tables, needed);
  add_needed(walks, needed);
  const RowBlocks blocks{inputs.rows(), rows_at_once};
  parallel_for(blocks.count(), max_threads, [&](Eigen::Index block) {
    const auto [begin, end] = blocks[block];
    const Eigen::Index count = end - begin;
    std::vector<double> x(model.num_inputs());
    Eigen::MatrixXd z(std::ssize(sum.features), count);
    for (Eigen::Index i = 0; i < count; ++i) {
      Eigen::Map<Eigen::VectorXd>(x.data(), model.num_inputs()) = inputs.row(begin + i);
      for (Eigen::Index k = 0; k < z.rows(); ++k) {
        z(k, i) = feature_at(sum.features[k], model.inputs(), model.deviations(), x.data());
      }
    }
    Eigen::MatrixXd columns;  // the same, feature by feature
    Eigen::MatrixXd in_slopes;
    if (is_by_columns) {
      columns.setZero(rows_at_once, z.rows());
      columns.topRows(count) = z.transpose();
      in_slopes = columns.array().isNaN().select(0.0, columns);
    }
    std::vector<Eigen::Index> by_splits;  // rows that tables and walks do not hold for
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto is_lacking = [&](int feature) { return std::isnan(z(feature, i)); };
      if (std::ranges::any_of(needed, is_lacking)) by_splits.push_back(i);
    }
    // Tree by tree, so that a tree stays in the cache for the rows of the block.
    std::array<double, rows_at_once> values = {};
    for (std::size_t k = 0; k < sum.trees.size(); ++k) {
      if (!tables[k] && !walks[k]) {
        for (Eigen::Index i = 0; i < count; ++i) values[i] += value_of(sum.trees[k], z.col(i).data());
        continue;
      }
      const std::array<double, rows_at_once> before = values;
      const bool is_for_some = std::ssize(by_splits) < count;
      if (is_for_some && tables[k]) add_values(*tables[k], columns.data(), in_slopes.data(), values.data());
      if (is_for_some && walks[k]) add_values(*walks[k], columns.data(), in_slopes.data(), values.data());
      for (const Eigen::Index i : by_splits) values[i] = before[i] + value_of(sum.trees[k], z.col(i).data());
    }
    for (Eigen::Index i = 0; i < count; ++i) result(begin + i) = sum.base + sum.rate * values[i];
  });
}

}  // namespace

double feature_at(const BoostedFeature& feature, std::span<const InputColumn> inputs,
                  std::span<const double> deviations, const double* x) {
  if (feature.level >= 0) {
    const InputColumn& input = inputs[feature.inputs.front()];
    double level = x[feature.inputs.front()];
    if (std::isnan(level) && input.has_empty_level()) level = static_cast<double>(input.levels.size() - 1);
    const bool is_known =
        level >= 0.0 && level < static_cast<double>(input.levels.size()) && level == std::floor(level);
    return is_known ? static_cast<double>(level == feature.level) : std::numeric_limits<double>::quiet_NaN();
  }
  double sum = 0.0;
  for (std::size_t k = 0; k < feature.inputs.size(); ++k) {
    const int input = feature.inputs[k];
    sum += feature.factors[k] * ((x[input] - inputs[input].centre) / deviations[input]);
  }
  return sum;
}

double value_of(const BoostedTree& tree, const double* z) {
  return value_below(tree, z, tree.splits.empty() ? -1 : 0, 1.0);
}

BoostedModel::BoostedModel(std::vector<InputColumn> inputs, std::vector<OutputColumn> outputs,
                           std::vector<double> deviations, std::vector<BoostedSum> sums, std::vector<Gap> gaps,
                           TrainingRecord record)
    : inputs_(std::move(inputs)),
      outputs_(std::move(outputs)),
      deviations_(std::move(deviations)),
      sums_(std::move(sums)),
      gaps_(std::move(gaps)),
      record_(std::move(record)) {
  check_boosted(inputs_, outputs_, deviations_, sums_);
  check_gaps(gaps_, num_inputs());
  check_record(record_, inputs_, outputs_.size());
}

BoostedSize size_of(const BoostedModel& model) {
  BoostedSize size;
  for (const BoostedSum& sum : model.sums()) {
    for (const BoostedTree& tree : sum.trees) {
      ++size.trees;
      size.leaves += std::ssize(tree.leaves);
      for (const BoostedLeaf& leaf : tree.leaves) size.parameters += 1 + std::ssize(leaf.slopes);
      for (const BoostedSplit& split : tree.splits) size.parameters += split.half_width > 0.0 ? 2 : 1;
    }
  }
  return size;
}

std::vector<bool> used_inputs(const BoostedModel& model) {
  std::vector<bool> used(model.num_inputs(), false);
  for (const BoostedSum& sum : model.sums()) {
    const auto use = [&](int feature) {
      for (const int input : sum.features[feature].inputs) used[input] = true;
    };
    for (const BoostedTree& tree : sum.trees) {
      for (const BoostedSplit& split : tree.splits) use(split.feature);
      for (const BoostedLeaf& leaf : tree.leaves) std::ranges::for_each(leaf.features, use);
    }
  }
  return used;
}

std::vector<double> distance_outside(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  check_rows("llmt::distance_outside", model, inputs);
  std::vector<double> distance(inputs.rows(), 0.0);
  for (Eigen::Index j = 0; j < inputs.cols(); ++j) {
    const InputColumn& column = model.inputs()[j];
    if (column.is_categorical()) continue;
    const double range = column.high - column.low;
    for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
      const double excess = std::max(column.low - inputs(row, j), inputs(row, j) - column.high);
      if (!(excess > 0.0)) continue;  // inside, or missing
      distance[row] = std::max(distance[row], excess / range);
    }
  }
  return distance;
}

std::vector<Eigen::Index> incomplete_rows(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  check_rows("llmt::incomplete_rows", model, inputs);
  const std::vector<bool> used = used_inputs(model);
  std::vector<Eigen::Index> incomplete;
  for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
    const auto is_lacking = [&](int j) {
      const InputColumn& input = model.inputs()[j];
      const double value = inputs(row, j);
      if (std::isnan(value)) return !input.has_empty_level();
      return input.is_categorical() && !(value >= 0.0 && value < static_cast<double>(input.levels.size()));
    };
    for (int j = 0; j < inputs.cols(); ++j) {
      if (!used[j] || !is_lacking(j)) continue;
      incomplete.push_back(row);
      break;
    }
  }
  return incomplete;
}

Eigen::MatrixXd BoostedModel::predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, int max_threads) const {
  check_rows("llmt::BoostedModel::predict", *this, inputs);
  Eigen::MatrixXd result(inputs.rows(), num_outputs());
  for (Eigen::Index o = 0; o < num_outputs(); ++o) predict_by(*this, sums_[o], inputs, max_threads, result.col(o));
  return result;
}

bool BoostedModel::has_intervals() const {
  return std::ranges::none_of(sums_, [](const BoostedSum& sum) { return sum.held_out.empty(); });
}

Bounds BoostedModel::intervals(const Eigen::Ref<const Eigen::MatrixXd>& inputs, double level, int max_threads,
                               const Eigen::VectorXd& weights) const {
  return intervals(inputs, std::vector<double>{level}, max_threads, weights).front();
}

std::vector<Bounds> BoostedModel::intervals(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                            const std::vector<double>& levels, int max_threads,
                                            const Eigen::VectorXd& weights) const {
  check_row_weights("llmt::BoostedModel::intervals", weights, inputs.rows());
  const Eigen::MatrixXd predicted = predict(inputs, max_threads);
  const Eigen::MatrixXd at = with_empty_levels(inputs_, inputs);
  const std::vector<Eigen::Index> in_gap = rows_in_gaps(gaps_, inputs);
  std::vector<Bounds> bounds(levels.size(), Bounds{.lower = predicted, .upper = predicted, .in_gap = in_gap});
  for (Eigen::Index o = 0; o < num_outputs(); ++o) {
    const std::vector<SumResiduals>& parts = sums_[o].held_out;
    Eigen::Index rows = 0;
    for (const SumResiduals& part : parts) rows += std::ssize(part.residuals);
    for (const double level : levels) check_level("llmt::BoostedModel::intervals", level, rows);
    std::vector<ScaledResiduals> residuals;
    for (const SumResiduals& part : parts) residuals.push_back({part.residuals});
    const double factor = factor_in_gaps(residuals);
    const RowBlocks blocks{inputs.rows(), rows_at_once};
    parallel_for(blocks.count(), max_threads, [&](Eigen::Index block) {
      const auto [begin, end] = blocks[block];
      std::vector<ScaledResiduals> scaled(parts.size());
      for (Eigen::Index row = begin; row < end; ++row) {
        const double in_gaps = std::ranges::binary_search(in_gap, row) ? factor : 1.0;
        for (std::size_t p = 0; p < parts.size(); ++p) {
          const double spread = spread_at(parts[p].spread, at, row, predicted(row, o));
          const double by_weight = weights.size() > 0 ? factor_of_weight(parts[p].spread, weights(row)) : 1.0;
          scaled[p] = {parts[p].residuals, 0.0, spread * by_weight * in_gaps};
        }
        for (std::size_t k = 0; k < levels.size(); ++k) {
          const double width = largest_value(scaled, values_outside(levels[k], rows));
          bounds[k].lower(row, o) -= width;
          bounds[k].upper(row, o) += width;
        }
      }
    });
  }
  return bounds;
}

std::vector<Eigen::MatrixXd> quantiles(const BoostedModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                       const std::vector<double>& probabilities, int max_threads,
                                       const Eigen::VectorXd& weights) {
  return quantiles_from(model.intervals(inputs, levels_of_quantiles(probabilities), max_threads, weights),
                        model.predict(inputs, max_threads), probabilities);
}

}  // namespace llmt
