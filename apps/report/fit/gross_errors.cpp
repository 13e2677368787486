#include "report/fit/gross_errors.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "llmt/outliers.hpp"

namespace llmt::report {
namespace {

constexpr Eigen::Index one_row_in = 100;
constexpr double most_of_the_error = 0.5;
constexpr double far_spreads = 15.0;         // of all held-out errors
constexpr double far_spreads_in_leaf = 8.0;  // of those in the row's leaf
constexpr Eigen::Index least_leaf_rows = 10;
constexpr double least_part_in_sample = 0.2;  // of the held-out error

struct HeldOutError {
  Eigen::Index row = 0;
  double error = 0.0;
  int leaf = 0;
};

// In the order of the folds.
std::vector<HeldOutError> held_out_errors(const TrainingData& data, const FitResult& result, int threads,
                                          Eigen::Index output, Eigen::Index partition) {
  const std::vector<Model>& models = result.intervals.models();
  const Eigen::MatrixXd& inputs = data.inputs;
  const std::vector<std::vector<Eigen::Index>>& of_folds = result.summary.held_out;
  std::vector<HeldOutError> errors;
  for (std::size_t f = 0; f < models.size(); ++f) {
    const Eigen::MatrixXd taken = inputs(of_folds[f], Eigen::all);
    const Eigen::VectorXd predicted = models[f].predict(taken, threads).col(output);
    const Eigen::VectorXi leaves = result.model.leaf_of(taken, threads).col(partition);
    for (std::size_t k = 0; k < of_folds[f].size(); ++k) {
      const Eigen::Index row = of_folds[f][k];
      errors.push_back({row, data.outputs(row, output) - predicted(k), leaves(k)});
    }
  }
  return errors;
}

double spread_of(const std::vector<double>& values) {
  return robust_scale(Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values))).deviation;
}

// The spread of the errors in each leaf, or of all errors if that is larger.
std::map<int, double> spreads_in_leaves(const std::vector<HeldOutError>& errors, double of_all) {
  std::map<int, std::vector<double>> of_leaves;
  for (const HeldOutError& each : errors) of_leaves[each.leaf].push_back(each.error);
  std::map<int, double> spreads;
  for (const auto& [leaf, values] : of_leaves) {
    spreads[leaf] = std::ssize(values) < least_leaf_rows ? of_all : std::max(of_all, spread_of(values));
  }
  return spreads;
}

Eigen::Index partition_of(const Model& model, Eigen::Index output) {
  Eigen::Index partition = 0;
  while (std::ranges::find(model.partitions()[partition].outputs, output) ==
         model.partitions()[partition].outputs.end()) {
    ++partition;
  }
  return partition;
}

}  // namespace

GrossErrors gross_errors(const TrainingData& data, const FitResult& result, Eigen::Index output, int max_threads) {
  std::vector<HeldOutError> errors =
      held_out_errors(data, result, max_threads, output, partition_of(result.model, output));
  if (errors.empty()) return {};
  std::vector<double> values;
  for (const HeldOutError& each : errors) values.push_back(each.error);
  const double spread = spread_of(values);
  const std::map<int, double> in_leaves = spreads_in_leaves(errors, spread);
  const Eigen::VectorXd& weights = data.weights;
  const auto square = [&](const HeldOutError& each) {
    return (weights.size() > 0 ? weights(each.row) : 1.0) * each.error * each.error;
  };
  double all = 0.0;
  for (const HeldOutError& each : errors) all += square(each);
  GrossErrors gross{.held_out = std::ssize(errors)};
  std::ranges::sort(errors, [](const HeldOutError& a, const HeldOutError& b) {
    const double of_a = std::abs(a.error);
    const double of_b = std::abs(b.error);
    return of_a != of_b ? of_a > of_b : a.row < b.row;
  });
  errors.resize(std::max<Eigen::Index>(1, std::ssize(errors) / one_row_in));
  std::erase_if(errors, [&](const HeldOutError& each) {
    const double error = std::abs(each.error);
    if (data.inputs.row(each.row).hasNaN()) return true;  // what is missing explains it
    return !(spread > 0.0 && error > far_spreads * spread && error > far_spreads_in_leaf * in_leaves.at(each.leaf));
  });
  for (const HeldOutError& each : errors) {
    const double predicted = result.model.predict(data.inputs.row(each.row))(0, output);
    if (std::abs(data.outputs(each.row, output) - predicted) < least_part_in_sample * std::abs(each.error)) continue;
    gross.rows.push_back(each.row);
    gross.share += square(each) / all;
  }
  if (!(gross.share > most_of_the_error)) gross.rows.clear();
  return gross;
}

}  // namespace llmt::report
