#include "growth/lolimot/boxes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/between.hpp"
#include "constraints/signs.hpp"
#include "data/missing.hpp"
#include "growth/search/split_search.hpp"
#include "numerics/node_fit.hpp"
#include "partition/imputed.hpp"

namespace llmt {
namespace {

// Far boxes underflow to zero. A row's own box does not for any usual number of inputs; for the others this keeps the
// sum of all validity functions positive.
constexpr double least_validity_function = 1e-280;

}  // namespace

LolimotData::LolimotData(const GrowthProblem& growth) : problem(growth) {
  const TrainingRows& training = *growth.training;
  const Table& table = *training.table;
  deviations = imputed(all_deviations(training), Eigen::VectorXd::Zero(std::ssize(training.regressors)));
  split_values = table.inputs(training.rows, growth.options.split_inputs);
  outputs = table.outputs(training.rows, growth.outputs);
  weights = training.weight_unit * table.weights(training.rows);
  const Eigen::RowVectorXd mean = weights.transpose() * outputs / weights.sum();
  output_weights = (weights.asDiagonal() * (outputs.rowwise() - mean).cwiseAbs2())
                       .colwise()
                       .sum()
                       .transpose()
                       .unaryExpr([](double squares) { return squares > 0.0 ? 1.0 / squares : 1.0; });
  signs = coefficient_signs(training);
}

bool LolimotData::is_categorical(Eigen::Index split_input) const {
  return problem.training->table->num_levels[problem.options.split_inputs[split_input]] > 0;
}

Eigen::VectorXd validity_function(const LolimotData& data, const Box& box, double width) {
  const Eigen::MatrixXd& values = data.split_values;
  Eigen::VectorXd exponent = Eigen::VectorXd::Zero(values.rows());
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    const double sigma = width * (box.high(j) - box.low(j));
    if (!(sigma > 0.0) || data.is_categorical(j)) continue;
    const double centre = 0.5 * (box.low(j) + box.high(j));
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      const double z = std::isnan(values(i, j)) ? 0.0 : (values(i, j) - centre) / sigma;
      exponent(i) -= 0.5 * z * z;
    }
  }
  return exponent.array().exp().max(least_validity_function);
}

std::vector<int> rows_in(const LolimotData& data, const Box& box, const Box& whole) {
  const auto is_inside = [&](double x, Eigen::Index j) {
    const bool is_first = box.low(j) == whole.low(j);
    if (std::isnan(x)) return is_first && box.high(j) == whole.high(j);
    return (x > box.low(j) || is_first) && x <= box.high(j);
  };
  std::vector<int> rows;
  for (int i = 0; i < data.split_values.rows(); ++i) {
    Eigen::Index j = 0;
    while (j < data.split_values.cols() && is_inside(data.split_values(i, j), j)) ++j;
    if (j == data.split_values.cols()) rows.push_back(i);
  }
  return rows;
}

std::optional<double> middle_of(const LolimotData& data, const Box& box, Eigen::Index split_input) {
  if (data.is_categorical(split_input) || !(box.low(split_input) < box.high(split_input))) return std::nullopt;
  return 0.5 * (box.low(split_input) + box.high(split_input));
}

std::optional<double> best_threshold_of(const LolimotData& data, const std::vector<int>& rows,
                                        Eigen::Index split_input) {
  if (data.is_categorical(split_input)) return std::nullopt;
  const auto value = [&](int k) { return data.split_values(rows[k], split_input); };
  std::vector<int> order;
  for (int k = 0; k < std::ssize(rows); ++k) {
    if (!std::isnan(value(k))) order.push_back(k);
  }
  std::ranges::stable_sort(order, [&](int a, int b) { return value(a) < value(b); });
  const Eigen::Index smallest = data.problem.options.min_leaf_samples;
  if (std::ssize(order) < 2 * smallest) return std::nullopt;
  const NodeFit crisp = fit_node(data.deviations(rows, Eigen::all), data.outputs(rows, Eigen::all), data.weights(rows));
  std::vector<double> values;
  for (const int k : order) {
    values.push_back(value(k));
  }
  const SearchNode node{crisp.features, data.output_weights, data.output_weights.dot(crisp.rss),
                        Eigen::VectorXd(data.weights(rows)).sum(), crisp.rank};
  InputSearch search(node, values, order, smallest);
  search.search_edges();
  search.refine(std::numeric_limits<double>::infinity());
  const SplitCandidate found = search.best();
  if (found.input < 0) return std::nullopt;
  return between(values[found.left - 1], values[found.left]);
}

}  // namespace llmt
