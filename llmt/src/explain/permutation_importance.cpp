#include "llmt/permutation_importance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/parallel.hpp"
#include "llmt/random.hpp"

namespace llmt {
namespace {

void check_permutation(const std::vector<Model>& models, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                       const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                       const std::vector<std::vector<Eigen::Index>>& held_out, const Eigen::VectorXd& weights,
                       const PermutationOptions& options) {
  const auto refuse = [](const std::string& what) {
    throw std::invalid_argument("llmt::permutation_importance: " + what);
  };
  if (options.repeats < 1) refuse(fmt::format("repeats is {}, it must be at least 1", options.repeats));
  if (options.most_rows < 10) refuse(fmt::format("most_rows is {}, it must be at least 10", options.most_rows));
  if (models.empty() || models.size() != held_out.size()) {
    refuse(fmt::format("{} models and held-out rows of {} folds", models.size(), held_out.size()));
  }
  if (inputs.rows() != outputs.rows() || outputs.cols() != models.front().num_outputs()) {
    refuse(fmt::format("inputs have {} rows, outputs are {} x {}, the models have {} outputs", inputs.rows(),
                       outputs.rows(), outputs.cols(), models.front().num_outputs()));
  }
  if (weights.size() > 0 && weights.size() != inputs.rows()) {
    refuse(fmt::format("{} weights of {} rows", weights.size(), inputs.rows()));
  }
  std::size_t count = 0;
  for (const std::vector<Eigen::Index>& rows : held_out) {
    count += rows.size();
    for (const Eigen::Index row : rows) {
      if (row < 0 || row >= inputs.rows()) refuse(fmt::format("there is no row {} of {}", row, inputs.rows()));
    }
  }
  if (count == 0) refuse("no row is held out");
}

// The rows of each fold that are looked at: `most` of all, evenly spaced.
std::vector<std::vector<Eigen::Index>> looked_at(const std::vector<std::vector<Eigen::Index>>& held_out,
                                                 Eigen::Index most) {
  Eigen::Index all = 0;
  for (const auto& rows : held_out) all += std::ssize(rows);
  if (all <= most) return held_out;
  std::vector<std::vector<Eigen::Index>> result;
  for (const auto& rows : held_out) {
    std::vector<Eigen::Index>& kept = result.emplace_back();
    const Eigen::Index count = std::ssize(rows);
    const Eigen::Index wanted = std::max(Eigen::Index{1}, count * most / all);
    for (Eigen::Index k = 0; k < std::min(wanted, count); ++k) kept.push_back(rows[k * count / wanted]);
  }
  return result;
}

// Squared errors of a model on rows.
Eigen::MatrixXd squares_of(const Model& model, const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs) {
  return (outputs - model.predict(inputs, 1)).cwiseAbs2();
}

// Mean over repeats of the squared errors with one input permuted.
Eigen::MatrixXd permuted_squares(const Model& model, const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs,
                                 Eigen::Index input, const PermutationOptions& options, std::uint64_t stream) {
  Random random(options.seed + 0x9e3779b97f4a7c15ULL * (stream + 1));
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(outputs.rows(), outputs.cols());
  Eigen::MatrixXd changed = inputs;
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    changed.col(input) = inputs.col(input)(random.permutation(inputs.rows()));
    sum += squares_of(model, changed, outputs);
  }
  return sum / static_cast<double>(options.repeats);
}

}  // namespace

PermutationImportance permutation_importance(const std::vector<Model>& models,
                                             const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                             const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                                             const std::vector<std::vector<Eigen::Index>>& held_out,
                                             const Eigen::VectorXd& weights, const PermutationOptions& options,
                                             const Progress& progress) {
  check_permutation(models, inputs, outputs, held_out, weights, options);
  const std::vector<std::vector<Eigen::Index>> of_folds = looked_at(held_out, options.most_rows);
  const Eigen::Index columns = inputs.cols();
  const Eigen::Index targets = outputs.cols();
  std::vector<Eigen::Index> begin = {0};
  for (const auto& rows : of_folds) begin.push_back(begin.back() + std::ssize(rows));
  const Eigen::Index count = begin.back();
  Eigen::VectorXd w = Eigen::VectorXd::Ones(count);
  Eigen::MatrixXd plain(count, targets);
  std::vector<Eigen::MatrixXd> permuted(static_cast<std::size_t>(columns), Eigen::MatrixXd(count, targets));
  Work work(progress);
  for (std::size_t f = 0; f < models.size(); ++f) {
    if (of_folds[f].empty()) continue;
    const Eigen::MatrixXd x = inputs(of_folds[f], Eigen::all);
    const Eigen::MatrixXd y = outputs(of_folds[f], Eigen::all);
    if (weights.size() > 0) w.segment(begin[f], x.rows()) = weights(of_folds[f]);
    plain.middleRows(begin[f], x.rows()) = squares_of(models[f], x, y);
    const std::vector<bool> used = used_inputs(models[f]);
    parallel_for(columns, options.max_threads, [&](Eigen::Index j) {
      Eigen::MatrixXd& of_input = permuted[static_cast<std::size_t>(j)];
      of_input.middleRows(begin[f], x.rows()) =
          used[static_cast<std::size_t>(j)]
              ? permuted_squares(models[f], x, y, j, options,
                                 f * static_cast<std::uint64_t>(columns) + static_cast<std::uint64_t>(j))
              : plain.middleRows(begin[f], x.rows());
      work.did(1.0 / static_cast<double>(columns * std::ssize(models)));
    });
  }
  const double total = w.sum();
  PermutationImportance result{.rows = count,
                               .rmse = Eigen::VectorXd(targets),
                               .increase = Eigen::MatrixXd(targets, columns),
                               .standard_error = Eigen::MatrixXd(targets, columns)};
  for (Eigen::Index o = 0; o < targets; ++o) {
    const double square = w.dot(plain.col(o)) / total;
    result.rmse(o) = std::sqrt(square);
    for (Eigen::Index j = 0; j < columns; ++j) {
      const Eigen::VectorXd difference = permuted[static_cast<std::size_t>(j)].col(o) - plain.col(o);
      const double mean = w.dot(difference) / total;
      const double without = std::sqrt(std::max(square + mean, 0.0));
      result.increase(o, j) = without - result.rmse(o);
      const double variance = (w.array().square() * (difference.array() - mean).square()).sum() / (total * total);
      result.standard_error(o, j) = without > 0.0 ? 0.5 * std::sqrt(variance) / without : 0.0;
    }
  }
  work.finish();
  return result;
}

}  // namespace llmt
