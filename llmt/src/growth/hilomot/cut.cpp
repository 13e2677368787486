#include "growth/hilomot/cut.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "data/missing.hpp"
#include "growth/hilomot/category_cut.hpp"
#include "growth/hilomot/gate_search.hpp"
#include "numerics/node_fit.hpp"
#include "partition/imputed.hpp"

namespace llmt {
namespace {

// Directions with less than this part of the largest variance, in standardised inputs, are collinear with others.
constexpr double collinear = 1e-8;

// The inputs of a leaf's rows as z = (x - mean) * whiten, which has weighted mean 0 and covariance 1.
struct WhiteInputs {
  Eigen::RowVectorXd mean;
  Eigen::MatrixXd whiten;  // inputs x directions
  Eigen::MatrixXd colour;  // inputs x directions; its transpose undoes `whiten`
  Eigen::MatrixXd z;       // rows x directions
};

// `x`: standardised inputs of the rows, rows x inputs. No directions if no input varies.
WhiteInputs white_inputs(Eigen::MatrixXd x, const Eigen::VectorXd& weights) {
  WhiteInputs result;
  const double total = weights.sum();
  result.mean = weights.transpose() * x / total;
  x.rowwise() -= result.mean;
  const Eigen::MatrixXd covariance = x.transpose() * (weights.asDiagonal() * x) / total;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  const Eigen::Index kept =
      (eigen.eigenvalues().array() > collinear * std::max(1e-12, eigen.eigenvalues().maxCoeff())).count();
  const Eigen::VectorXd root = eigen.eigenvalues().tail(kept).cwiseSqrt();
  result.whiten = eigen.eigenvectors().rightCols(kept) * root.cwiseInverse().asDiagonal();
  result.colour = eigen.eigenvectors().rightCols(kept) * root.asDiagonal();
  result.z = x * result.whiten;
  return result;
}

// The leaf's rows as a problem of gates, without `z`: regressors in orthonormal columns, outputs without what one model
// explains. Sets `rss` to the weighted error of that one model.
GateProblem gate_problem(const GrowthData& data, const HilomotInputs& inputs, const HilomotLeaf& leaf,
                         Eigen::VectorXd weights, double& rss) {
  GateProblem problem;
  problem.weights = std::move(weights);
  problem.output_weights = data.output_weights;
  const NodeFit whole =
      fit_node(inputs.deviations(leaf.rows, Eigen::all), data.outputs(leaf.rows, Eigen::all), problem.weights);
  problem.a.resize(std::ssize(leaf.rows), whole.features.coefficients());
  for (Eigen::Index i = 0; i < problem.a.rows(); ++i) {
    const double* row = whole.features.row(i);
    problem.a.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row, problem.a.cols()) / row[0];
  }
  problem.y = whole.residuals();
  rss = data.output_weights.dot(whole.rss);
  return problem;
}

// Sets `problem.z`.
HilomotCut best_plane(const HilomotInputs& inputs, const HilomotLeaf& leaf, int max_threads, GateProblem& problem,
                      Eigen::Index& evaluations) {
  HilomotCut cut;
  const Eigen::Index axes = std::ssize(inputs.numeric);
  if (axes == 0) return cut;
  const WhiteInputs white = white_inputs(inputs.standardised(leaf.rows, Eigen::all), problem.weights);
  const Eigen::Index kept = white.z.cols();
  if (kept == 0) return cut;
  problem.z.resize(white.z.rows(), kept + 1);
  problem.z << white.z, Eigen::VectorXd::Ones(white.z.rows());
  Eigen::VectorXd above = Eigen::VectorXd::Zero(kept);
  if (leaf.normal.size() > 0) above = white.colour.transpose() * leaf.normal;
  Eigen::MatrixXd directions(kept, axes + 2);  // the axes, the most curved one, that of the split above
  directions << white.colour.transpose(), most_curved(problem), above;
  const GateFit best = best_gate(problem, directions, axes, max_threads);
  evaluations += best.evaluations;
  if (!std::isfinite(best.loss)) return cut;
  cut.loss = best.loss;
  // u = steepness . z + offset = normal . (standardised - mean) / half width + offset.
  const Eigen::VectorXd normal = white.whiten * best.gate.head(kept);
  cut.half_width = 1.0 / normal.norm();
  cut.normal = normal * cut.half_width;
  cut.threshold = white.mean * cut.normal - best.gate(kept) * cut.half_width;
  cut.share = gate_shares(problem, best.gate);
  return cut;
}

HilomotCut best_levels(const GrowthData& data, const HilomotLeaf& leaf, int input, const GateProblem& problem,
                       Eigen::Index& evaluations) {
  const Table& table = *data.training.table;
  Eigen::VectorXd values(std::ssize(leaf.rows));
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    values(i) = table.inputs(data.training.rows[leaf.rows[i]], input);
  }
  LevelCut levels = best_level_cut(problem, values, table.num_levels[input]);
  evaluations += levels.evaluations;
  HilomotCut cut;
  cut.loss = levels.loss;
  cut.input = input;
  cut.level_side = std::move(levels.side);
  cut.missing_left = levels.left_share;
  cut.share = std::move(levels.share);
  return cut;
}

}  // namespace

HilomotInputs::HilomotInputs(const GrowthData& data) {
  const TrainingRows& training = data.training;
  deviations = imputed(all_deviations(training), Eigen::VectorXd::Zero(std::ssize(training.regressors)));
  const double total = data.total_weight;
  for (Eigen::Index j = 0; j < data.split_inputs(); ++j) {
    const int input = data.problem.options.split_inputs[j];
    if (data.num_levels[j] > 0) {
      categorical.push_back(input);
      continue;
    }
    const double centre = training.columns[input].centre;
    Eigen::VectorXd values(training.count());
    for (int i = 0; i < values.size(); ++i) {
      const double value = data.split_value(i, j);
      values(i) = std::isnan(value) ? 0.0 : value - centre;
    }
    const double largest = values.cwiseAbs().maxCoeff();
    if (!(largest > 0.0)) continue;
    const double spread = largest * std::sqrt(data.weights.dot((values / largest).cwiseAbs2()) / total);
    numeric.push_back(input);
    spreads.push_back(spread);
    standardised.conservativeResize(values.size(), std::ssize(numeric));
    standardised.rightCols(1) = values / spread;
  }
}

std::optional<HilomotCut> best_cut(const GrowthData& data, const HilomotInputs& inputs, const HilomotLeaf& leaf,
                                   GateModels models, Eigen::Index& evaluations) {
  const double least_weight = std::max(static_cast<double>(data.problem.options.min_leaf_samples),
                                       static_cast<double>(inputs.deviations.cols() + 1));
  Eigen::VectorXd weights = leaf.validity.cwiseProduct(data.weights(leaf.rows));
  if (weights.sum() < 2.0 * least_weight) return std::nullopt;
  double before = 0.0;
  GateProblem problem = gate_problem(data, inputs, leaf, std::move(weights), before);
  problem.least_weight = least_weight;
  problem.models = models;
  HilomotCut best = best_plane(inputs, leaf, data.problem.max_threads, problem, evaluations);
  for (const int input : inputs.categorical) {
    HilomotCut cut = best_levels(data, leaf, input, problem, evaluations);
    if (cut.loss < best.loss) best = std::move(cut);
  }
  if (best.loss < before) return best;
  return std::nullopt;
}

}  // namespace llmt
