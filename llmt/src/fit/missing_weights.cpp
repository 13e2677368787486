#include "fit/missing_weights.hpp"

#include <Eigen/Cholesky>
#include <utility>
#include <vector>

#include "base/sum_over.hpp"
#include "fit/plan/defaults.hpp"
#include "fit/plan/preliminary.hpp"
#include "fit/trees/error_weights.hpp"
#include "fit/trees/grow_tree.hpp"
#include "llmt/model.hpp"

namespace llmt {
namespace {

constexpr double least_weight = 0.01;
constexpr double prior_rows = 40.0;  // for an input, as if this many rows more had no larger variance without it

// Squared residuals of preliminary trees, of all outputs together, each divided by its variance.
Eigen::VectorXd squared_residuals(const TrainingRows& all, const FitOptions& options, Work& work) {
  const Table& table = *all.table;
  const Plan plan = with_defaults(preliminary_options(options), all, 0);
  std::vector<Partition> partitions;
  for (int output = 0; output < table.outputs.cols(); ++output) {
    Work tree(work, 0.1 / static_cast<double>(table.outputs.cols()));
    partitions.push_back(grow_tree(all, {output}, plan, true, options.max_threads, tree).tree.partition);
  }
  const Model model(all.columns, all.output_columns, all.regressors, std::move(partitions));
  const Eigen::MatrixXd outputs = table.outputs(all.rows, Eigen::all);
  const Eigen::MatrixXd residuals = outputs - model.predict(table.inputs(all.rows, Eigen::all), options.max_threads);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(residuals.rows());
  for (Eigen::Index o = 0; o < residuals.cols(); ++o) {
    const double variance = variance_of(outputs.col(o));
    if (variance > 0.0) squares += residuals.col(o).cwiseAbs2() / variance;
  }
  return squares;
}

// Columns 1, and for each input with missing values whether it is missing.
Eigen::MatrixXd indicators(const TrainingRows& all) {
  const Eigen::MatrixXd missing = all.table->inputs(all.rows, Eigen::all).array().isNaN().cast<double>();
  std::vector<Eigen::Index> columns;
  for (Eigen::Index j = 0; j < missing.cols(); ++j) {
    if (missing.col(j).maxCoeff() > 0.0) columns.push_back(j);
  }
  Eigen::MatrixXd result(missing.rows(), 1 + std::ssize(columns));
  result << Eigen::VectorXd::Ones(missing.rows()), missing(Eigen::all, columns);
  return result;
}

}  // namespace

Eigen::VectorXd weights_by_missing(const TrainingRows& all, const FitOptions& options, Work& work) {
  const Eigen::VectorXd squares = squared_residuals(all, options, work);
  const Eigen::VectorXd row_weights = all.table->weights(all.rows);
  const Eigen::MatrixXd a = indicators(all);
  const Eigen::Index size = a.cols();
  // The normal equations of the regression of the squares on the indicators, right-hand side last.
  const auto add = [&](RowSpan block, Eigen::MatrixXd& sum) {
    const auto rows = a.middleRows(block.begin, block.count());
    const auto weights = row_weights.segment(block.begin, block.count());
    sum.leftCols(size) += rows.transpose() * weights.asDiagonal() * rows;
    sum.col(size) += rows.transpose() * weights.cwiseProduct(squares.segment(block.begin, block.count()));
  };
  Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(size, size + 1);
  Eigen::MatrixXd equations = sum_over(RowBlocks{a.rows()}, options.max_threads, std::move(zero), add);
  equations.diagonal().tail(size - 1).array() += prior_rows;
  const Eigen::VectorXd variances = equations.leftCols(size).ldlt().solve(equations.col(size));
  const double complete = variances(0);
  if (!(complete > 0.0)) return Eigen::VectorXd::Ones(all.count());
  const Eigen::VectorXd added = variances.tail(variances.size() - 1).cwiseMax(0.0) / complete;
  const Eigen::VectorXd variance = (a.rightCols(added.size()) * added).array() + 1.0;
  return variance.cwiseInverse().cwiseMax(least_weight);
}

}  // namespace llmt
