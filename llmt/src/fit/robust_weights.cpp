#include "fit/robust_weights.hpp"

#include <algorithm>
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

// The outputs, held within `clip_spreads` spreads of their median.
Eigen::MatrixXd clipped(const Eigen::Ref<const Eigen::MatrixXd>& outputs) {
  Eigen::MatrixXd result = outputs;
  for (auto output : result.colwise()) {
    const RobustScale scale = robust_scale(output);
    if (scale.deviation == 0.0) continue;
    const double reach = clip_spreads * scale.deviation;
    output = output.cwiseMax(scale.median - reach).cwiseMin(scale.median + reach);
  }
  return result;
}

// For each row the spread of the residuals in its leaf, or of all residuals if that is larger.
Eigen::VectorXd spreads_at(const Eigen::VectorXd& residuals, const Eigen::VectorXi& leaf, double least) {
  std::vector<std::vector<Eigen::Index>> rows(leaf.maxCoeff() + 1);
  for (Eigen::Index row = 0; row < leaf.size(); ++row) rows[leaf(row)].push_back(row);
  const double all = std::max(least, robust_scale(residuals).deviation);
  Eigen::VectorXd spread = Eigen::VectorXd::Constant(residuals.size(), all);
  for (const std::vector<Eigen::Index>& of_leaf : rows) {
    if (std::ssize(of_leaf) < least_leaf_rows) continue;
    spread(of_leaf).setConstant(std::max(all, robust_scale(residuals(of_leaf)).deviation));
  }
  return spread;
}

Eigen::VectorXd biweights(const Model& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                          const Eigen::Ref<const Eigen::MatrixXd>& outputs, int max_threads) {
  const Eigen::MatrixXd residuals = outputs - model.predict(inputs, max_threads);
  const Eigen::MatrixXi leaves = model.leaf_of(inputs, max_threads);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(outputs.rows());
  for (std::size_t p = 0; p < model.partitions().size(); ++p) {
    for (const int output : model.partitions()[p].outputs) {
      const double least = least_spread * robust_scale(outputs.col(output)).deviation;
      const Eigen::VectorXd spread = spreads_at(residuals.col(output), leaves.col(p), least);
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
  const Eigen::Ref<const Eigen::MatrixXd>& inputs = kept.inputs.values;
  const Eigen::Ref<const Eigen::MatrixXd>& outputs = kept.outputs.values;
  const FitOptions preliminary = preliminary_options(options);
  const auto model_of = [&](const SharedMatrix& taught, const Eigen::VectorXd& weights) {
    Work half(work, 0.5);
    const GivenRows rows{.inputs = kept.inputs,
                         .outputs = taught,
                         .weights = weights,
                         .groups = kept.groups,
                         .categorical = given.categorical,
                         .numbers = numbers_at(given, kept.rows)};
    return fit(prepare_plain(rows, preliminary, half), half).model;
  };
  const Model of_clipped = model_of(shared(clipped(outputs)), kept.weights);
  const Eigen::VectorXd first = biweights(of_clipped, inputs, outputs, options.max_threads);
  const Model of_weighted = model_of(kept.outputs, kept.weights.cwiseProduct(first));
  const Eigen::VectorXd of_kept = biweights(of_weighted, inputs, outputs, options.max_threads);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(std::ssize(kept.row_of));
  for (Eigen::Index row = 0; row < weights.size(); ++row) {
    if (const int of_row = kept.row_of[row]; of_row >= 0) weights(row) = of_kept(of_row);
  }
  return weights;
}

Eigen::VectorXd without_outliers(const Eigen::VectorXd& given, const Eigen::VectorXd& robust) {
  const Eigen::VectorXd kept = (robust.array() > 0.0).cast<double>();
  return given.size() == 0 ? kept : given.cwiseProduct(kept);
}

}  // namespace llmt
