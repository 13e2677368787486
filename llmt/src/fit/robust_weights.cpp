#include "fit/robust_weights.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "fit/pipeline.hpp"
#include "fit/plan/preliminary.hpp"
#include "llmt/outliers.hpp"

namespace llmt {
namespace {

constexpr double clip_spreads = 5.0;  // the outputs of the first tree lie within this many spreads of their median
constexpr double biweight_spreads = 4.685;  // 95 % of the efficiency of least squares for normal noise
constexpr double least_spread = 1e-9;       // of the residuals, by the spread of the output
constexpr double least_biweight = 1e-12;    // less is 0
constexpr Eigen::Index least_leaf_rows = 10;

// Rows that the weights are found from, and which of them the model is fitted to: all but those that the caller holds
// out.
struct Judged {
  const Eigen::Ref<const Eigen::MatrixXd>& inputs;
  const Eigen::Ref<const Eigen::MatrixXd>& outputs;
  std::vector<Eigen::Index> learned;
};

std::vector<Eigen::Index> learned_in(const KeptRows& kept) {
  if (kept.is_fold_given && !kept.folds.empty()) return kept.folds.front().train;
  std::vector<Eigen::Index> all(kept.count());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

// The outputs, held within `clip_spreads` spreads of their median.
Eigen::MatrixXd clipped(const Judged& rows) {
  Eigen::MatrixXd result = rows.outputs;
  for (auto output : result.colwise()) {
    const RobustScale scale = robust_scale(output(rows.learned));
    if (scale.deviation == 0.0) continue;
    const double reach = clip_spreads * scale.deviation;
    output = output.cwiseMax(scale.median - reach).cwiseMin(scale.median + reach);
  }
  return result;
}

// For each row the spread of the residuals in its leaf, or of all residuals if that is larger.
Eigen::VectorXd spreads_at(const Eigen::VectorXd& residuals, const Eigen::VectorXi& leaf,
                           const std::vector<Eigen::Index>& learned, double least) {
  std::vector<std::vector<Eigen::Index>> rows(leaf.maxCoeff() + 1);
  for (const Eigen::Index row : learned) rows[leaf(row)].push_back(row);
  const double all = std::max(least, robust_scale(residuals(learned)).deviation);
  Eigen::VectorXd of_leaf = Eigen::VectorXd::Constant(std::ssize(rows), all);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (std::ssize(rows[i]) < least_leaf_rows) continue;
    of_leaf(static_cast<Eigen::Index>(i)) = std::max(all, robust_scale(residuals(rows[i])).deviation);
  }
  return of_leaf(leaf);
}

Eigen::VectorXd biweights(const Model& model, const Judged& rows, int max_threads) {
  const Eigen::Ref<const Eigen::MatrixXd>& outputs = rows.outputs;
  const Eigen::MatrixXd residuals = outputs - model.predict(rows.inputs, max_threads);
  const Eigen::MatrixXi leaves = model.leaf_of(rows.inputs, max_threads);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(outputs.rows());
  for (std::size_t p = 0; p < model.partitions().size(); ++p) {
    for (const int output : model.partitions()[p].outputs) {
      const double least = least_spread * robust_scale(outputs.col(output)(rows.learned)).deviation;
      const Eigen::VectorXd spread = spreads_at(residuals.col(output), leaves.col(p), rows.learned, least);
      // A spread of 0: more than half of the outputs agree, and are predicted without an error.
      const Eigen::ArrayXd u =
          (spread.array() > 0.0).select(residuals.col(output).array() / (biweight_spreads * spread.array()), 0.0);
      const Eigen::ArrayXd biweight = (1.0 - u.square()).max(0.0).square();
      weights = weights.cwiseMin((biweight > least_biweight).select(biweight, 0.0).matrix());
    }
  }
  return weights;
}

}  // namespace

Eigen::VectorXd robust_weights(const GivenRows& given, const FitOptions& options, Work& work) {
  const KeptRows kept = keep(given, options.folds);
  const Judged judged{kept.inputs.values, kept.outputs.values, learned_in(kept)};
  std::vector<bool> held_out(kept.is_fold_given ? kept.count() : 0, true);
  for (std::size_t i = 0; kept.is_fold_given && i < judged.learned.size(); ++i) held_out[judged.learned[i]] = false;
  const FitOptions preliminary = preliminary_options(options);
  const auto model_of = [&](const SharedMatrix& taught, const Eigen::VectorXd& weights) {
    Work half(work, 0.5);
    const GivenRows rows{.inputs = kept.inputs,
                         .outputs = taught,
                         .weights = weights,
                         .groups = kept.groups,
                         .held_out = held_out,
                         .categorical = given.categorical,
                         .numbers = numbers_at(given, kept.rows)};
    return fit(prepare_plain(rows, preliminary, half), half).model;
  };
  const Model of_clipped = model_of(shared(clipped(judged)), kept.weights);
  const Eigen::VectorXd first = biweights(of_clipped, judged, options.max_threads);
  const Model of_weighted = model_of(kept.outputs, kept.weights.cwiseProduct(first));
  const Eigen::VectorXd of_kept = biweights(of_weighted, judged, options.max_threads);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(given.inputs.values.rows());
  for (const RowPlace& place : kept.places) weights(place.given) = of_kept(place.kept);
  return weights;
}

Eigen::VectorXd without_outliers(const Eigen::VectorXd& given, const Eigen::VectorXd& robust) {
  const Eigen::VectorXd kept = (robust.array() > 0.0).cast<double>();
  return given.size() == 0 ? kept : given.cwiseProduct(kept);
}

}  // namespace llmt
