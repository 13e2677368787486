#include "model/held_out_intervals.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/incomplete.hpp"
#include "spread/fit_gaps.hpp"
#include "spread/fit_spread.hpp"

namespace llmt {
namespace {

// The held-out rows of all folds and the part that each is of: its fold, or one of five of the only fold.
struct DealtFolds {
  std::vector<int> rows;
  std::vector<int> part;
  int parts = 1;
};

DealtFolds dealt(const std::vector<std::span<const int>>& held_out) {
  DealtFolds result{.rows = {}, .part = {}, .parts = static_cast<int>(held_out.size())};
  for (std::size_t f = 0; f < held_out.size(); ++f) {
    result.rows.insert(result.rows.end(), held_out[f].begin(), held_out[f].end());
    result.part.insert(result.part.end(), held_out[f].size(), static_cast<int>(f));
  }
  if (held_out.size() == 1 && std::ssize(result.rows) >= fewest_rows_of_spread) {
    result.part = dealt_parts(std::ssize(result.rows), parts_of_one_fold);
    result.parts = parts_of_one_fold;
  }
  return result;
}

// The square root of (K - 1) / K, for K models, times what each prediction differs from the mean of the other models':
// the variance of this is that of one model.
Eigen::MatrixXd differences_of_folds(const Eigen::MatrixXd& predictions, const std::vector<Eigen::MatrixXd>& by_model) {
  const auto count = static_cast<double>(by_model.size());
  if (by_model.size() < 2) return Eigen::MatrixXd::Zero(predictions.rows(), predictions.cols());
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(predictions.rows(), predictions.cols());
  for (const Eigen::MatrixXd& each : by_model) mean += each / count;
  // f_k - mean of others = (f_k - mean of all) K / (K - 1)
  return (predictions - mean) * std::sqrt(count / (count - 1.0));
}

// The deviation of normal numbers with this median size. A mean would be that of the few rows that are far from others.
double usual_size(const Eigen::VectorXd& differences) {
  constexpr double median_of_normal = 0.6744897501960817;
  if (differences.size() == 0) return 0.0;
  std::vector<double> sizes;
  for (const double difference : differences) sizes.push_back(std::abs(difference));
  const auto middle = sizes.begin() + std::ssize(sizes) / 2;
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle / median_of_normal;
}

// What the spreads of all outputs divide: one spread an output for each part, none if all are 1 everywhere.
std::vector<std::vector<Spread>> divide_by_spreads(const std::vector<InputColumn>& columns, const Eigen::MatrixXd& x,
                                                   const Eigen::MatrixXd& predictions, const DealtFolds& dealt,
                                                   const Eigen::VectorXd& weights, Eigen::MatrixXd& residuals,
                                                   Eigen::MatrixXd& differences) {
  std::vector<std::vector<Spread>> spreads(dealt.parts);
  bool has_spread = false;
  for (Eigen::Index o = 0; o < residuals.cols(); ++o) {
    std::vector<Spread> of_output =
        fit_spreads({x, columns, predictions.col(o), residuals.col(o), weights}, dealt.part, dealt.parts);
    for (Eigen::Index i = 0; i < residuals.rows(); ++i) {
      const Spread& of_part = of_output[dealt.part[i]];
      const double spread = spread_at(of_part, x, i, predictions(i, o));
      residuals(i, o) /= weights.size() > 0 ? spread * factor_of_weight(of_part, weights(i)) : spread;
      differences(i, o) /= spread;
    }
    for (int p = 0; p < dealt.parts; ++p) {
      has_spread = has_spread || !of_output[p].is_even();
      spreads[p].push_back(std::move(of_output[p]));
    }
  }
  if (!has_spread) spreads.assign(dealt.parts, {});
  return spreads;
}

// The gaps of all rows in the numbers that the models use.
std::vector<Gap> gaps_of(const std::vector<Model>& models, const Eigen::Ref<const Eigen::MatrixXd>& inputs) {
  std::vector<int> columns;
  std::vector<std::vector<bool>> used;
  for (const Model& model : models) used.push_back(used_inputs(model));
  for (std::size_t j = 0; j < models.front().inputs().size(); ++j) {
    const bool is_used = std::ranges::any_of(used, [&](const std::vector<bool>& of_model) { return of_model[j]; });
    if (is_used && !models.front().inputs()[j].is_categorical()) columns.push_back(static_cast<int>(j));
  }
  return fit_gaps(inputs, columns);
}

// Rows and mean squares of the leaves of each output; `x`, `residuals`: of the held-out rows.
std::vector<std::vector<LeafRecord>> record_of_leaves(const Model& model, const Eigen::MatrixXd& x,
                                                      const Eigen::MatrixXd& residuals, int max_threads) {
  std::vector<std::vector<LeafRecord>> leaves(static_cast<std::size_t>(residuals.cols()));
  const Eigen::MatrixXi leaf_of = model.leaf_of(x, max_threads);
  for (std::size_t p = 0; p < model.partitions().size(); ++p) {
    const Partition& partition = model.partitions()[p];
    for (const int output : partition.outputs) {
      std::vector<LeafRecord>& of_output = leaves[static_cast<std::size_t>(output)];
      of_output.resize(static_cast<std::size_t>(partition.num_leaves()));
      for (Eigen::Index row = 0; row < x.rows(); ++row) {
        LeafRecord& leaf = of_output[static_cast<std::size_t>(leaf_of(row, static_cast<Eigen::Index>(p)))];
        ++leaf.rows;
        leaf.mean_square += residuals(row, output) * residuals(row, output);
      }
      for (LeafRecord& leaf : of_output) leaf.mean_square /= static_cast<double>(std::max(leaf.rows, Eigen::Index{1}));
    }
  }
  return leaves;
}

// Of the inputs that the model uses, from all rows.
std::vector<InputRecord> record_of_inputs(const Model& model, const MeasuredRows& rows) {
  const std::vector<bool> used = used_inputs(model);
  const Eigen::MatrixXd x = with_empty_levels(model.inputs(), rows.inputs);
  std::vector<InputRecord> inputs(used.size());
  for (std::size_t j = 0; j < used.size(); ++j) {
    if (!used[j]) continue;
    inputs[j] = record_of(x.col(static_cast<Eigen::Index>(j)), model.inputs()[j].levels.size(), rows.copies);
  }
  return inputs;
}

}  // namespace

Intervals held_out_intervals(std::vector<Model> models, const Model& of_all, const MeasuredRows& rows,
                             int max_threads) {
  if (models.empty()) return {};
  const auto& [inputs, outputs, precisions, copies, held_out, size_limit] = rows;
  const bool is_one_fold = models.size() == 1;
  const DealtFolds folds = dealt(held_out);
  const std::vector<InputColumn>& columns = models.front().inputs();
  const Eigen::MatrixXd x = with_empty_levels(columns, inputs(folds.rows, Eigen::all));
  std::vector<Eigen::MatrixXd> by_model;
  for (const Model& model : models) by_model.push_back(model.predict(x, max_threads));
  Eigen::MatrixXd predictions(x.rows(), outputs.cols());
  for (Eigen::Index i = 0; i < x.rows(); ++i) predictions.row(i) = by_model[is_one_fold ? 0 : folds.part[i]].row(i);
  Eigen::MatrixXd residuals = (outputs(folds.rows, Eigen::all) - predictions).cwiseAbs();
  Eigen::MatrixXd differences = differences_of_folds(predictions, by_model);
  const Eigen::VectorXd weights = precisions.size() > 0 ? precisions(folds.rows).eval() : Eigen::VectorXd();
  std::vector<std::vector<Spread>> spreads =
      divide_by_spreads(columns, x, predictions, folds, weights, residuals, differences);
  const std::vector<bool> incomplete = incomplete_rows(models, x);
  std::vector<HeldOutPart> parts;
  for (int p = 0; p < folds.parts; ++p) {
    std::vector<int> whole;
    std::vector<int> lacking;
    for (int i = 0; i < static_cast<int>(x.rows()); ++i) {
      if (folds.part[i] == p) (incomplete[i] ? lacking : whole).push_back(i);
    }
    HeldOutPart& part = parts.emplace_back();
    part.model = is_one_fold ? 0 : static_cast<std::size_t>(p);
    part.residuals = residuals(whole, Eigen::all);
    part.incomplete = residuals(lacking, Eigen::all);
    part.spreads = std::move(spreads[p]);
    if (is_one_fold || x.rows() < fewest_rows_of_spread) continue;
    whole.insert(whole.end(), lacking.begin(), lacking.end());
    for (Eigen::Index o = 0; o < outputs.cols(); ++o) {
      part.disagreement.push_back(usual_size(differences.col(o)(whole)));
    }
  }
  std::vector<Gap> gaps = gaps_of(models, inputs);
  TrainingRecord record{.inputs = record_of_inputs(of_all, rows),
                        .leaves = record_of_leaves(of_all, x, residuals, max_threads),
                        .size_limit = size_limit};
  return {std::move(models), std::move(parts), std::move(gaps), std::move(record)};
}

}  // namespace llmt
