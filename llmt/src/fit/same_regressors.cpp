#include "fit/same_regressors.hpp"

#include <algorithm>
#include <utility>

namespace llmt {
namespace {

Eigen::VectorXd widened(const Eigen::VectorXd& values, const std::vector<Eigen::Index>& positions, Eigen::Index size) {
  if (values.size() == 0) return values;
  Eigen::VectorXd result = Eigen::VectorXd::Zero(size);
  result(positions) = values;
  return result;
}

Eigen::MatrixXd widened_columns(const Eigen::MatrixXd& slopes, const std::vector<Eigen::Index>& positions,
                                Eigen::Index size) {
  if (slopes.size() == 0) return slopes;
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(slopes.rows(), size);
  result(Eigen::all, positions) = slopes;
  return result;
}

// The Gram matrix of [1, deviations] with zeros for the regressors that it lacks.
Eigen::MatrixXd widened_gram(const Eigen::MatrixXd& gram, const std::vector<Eigen::Index>& positions,
                             Eigen::Index size) {
  if (gram.size() == 0) return gram;
  std::vector<Eigen::Index> all = {0};
  for (const Eigen::Index position : positions) all.push_back(position + 1);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size + 1, size + 1);
  result(all, all) = gram;
  return result;
}

// Gives a partition `size` regressors, of which those at `positions` are its own.
void set_on_regressors(Partition& partition, const std::vector<Eigen::Index>& positions, Eigen::Index size) {
  for (Node& node : partition.nodes) {
    node.slope = widened_columns(node.slope, positions, size);
    node.mean = widened(node.mean, positions, size);
    node.low = widened(node.low, positions, size);
    node.high = widened(node.high, positions, size);
    node.inverse_gram = widened_gram(node.inverse_gram, positions, size);
  }
  partition.outer_slope = widened_columns(partition.outer_slope, positions, size);
}

}  // namespace

Model make_model(const TrainingRows& rows, std::vector<PartitionOn> partitions) {
  std::vector<Regressor> used;
  for (const Regressor& regressor : rows.regressors) {
    const auto has_it = [&](const PartitionOn& each) { return std::ranges::count(each.regressors, regressor) > 0; };
    if (std::ranges::any_of(partitions, has_it)) used.push_back(regressor);
  }
  std::vector<Partition> alone;
  for (PartitionOn& each : partitions) {
    if (each.regressors != used) {
      std::vector<Eigen::Index> positions;
      for (const Regressor& regressor : each.regressors) {
        positions.push_back(std::ranges::find(used, regressor) - used.begin());
      }
      set_on_regressors(each.partition, positions, std::ssize(used));
    }
    alone.push_back(std::move(each.partition));
  }
  return {rows.columns, rows.output_columns, std::move(used), std::move(alone)};
}

}  // namespace llmt
