// The model of a stream as it stands.
#include <fmt/format.h>

#include <numeric>
#include <utility>

#include "base/matrix.hpp"
#include "data/dataset.hpp"
#include "fit/pipeline.hpp"
#include "stream/crisp_partition.hpp"
#include "stream/snapshot.hpp"
#include "stream/state.hpp"

namespace llmt {

Model StreamState::snapshot(ValidityChoice validity) const {
  if (trees_.empty()) return model_of_first_rows();
  std::vector<InputColumn> inputs;
  std::vector<OutputColumn> outputs;
  std::vector<Regressor> regressors;
  for (int j = 0; j < inputs_; ++j) {
    const ColumnRange& column = columns_[j];
    inputs.push_back(
        {.name = fmt::format("x{}", j + 1), .low = column.low, .high = column.high, .centre = column.mean});
    regressors.push_back({j, -1, column.mean});
  }
  for (Eigen::Index o = 0; o < outputs_; ++o) {
    const ColumnRange& column = columns_[inputs_ + o];
    outputs.push_back({outputs_ == 1 ? "y" : fmt::format("y{}", o + 1), column.low, column.high});
  }
  std::vector<Partition> partitions = crisp_partitions();
  choose_by_reservoir(inputs, regressors, validity, partitions);
  for (Partition& partition : partitions) {
    for (Node& node : partition.nodes) {
      if (!node.is_leaf()) node.inverse_gram.resize(0, 0);
    }
  }
  return Model(std::move(inputs), std::move(outputs), std::move(regressors), std::move(partitions));
}

// One linear model of the rows before the trees start.
Model StreamState::model_of_first_rows() const {
  const Eigen::Map<const RowMajor> first(first_rows_.data(), std::ssize(first_rows_) / width(), width());
  FitOptions one_leaf;
  one_leaf.max_leaves = 1;
  one_leaf.folds.count = 0;
  const Eigen::MatrixXd inputs = first.leftCols(inputs_);
  const Eigen::MatrixXd outputs = first.middleCols(inputs_, outputs_);
  // Not fit(), which refuses an output that hides the others: the trees of a stream take it too.
  Work uncounted;
  const GivenRows rows{.inputs = {inputs}, .outputs = {outputs}, .weights = first.rightCols(1)};
  return fit(prepare_plain(checked(rows, one_leaf), one_leaf, uncounted), uncounted).model;
}

std::vector<Partition> StreamState::crisp_partitions() const {
  const std::vector<ColumnRange> of_inputs(columns_.begin(), columns_.begin() + inputs_);
  std::vector<Partition> partitions;
  for (int o = 0; o < outputs_; ++o) {
    const StreamTree& tree = *trees_[o];
    partitions.push_back(crisp_partition(tree.setting(), tree.root(), of_inputs, o));
  }
  return partitions;
}

// Replaces each partition by the one that choose() takes on the rows of the reservoir.
void StreamState::choose_by_reservoir(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors,
                                      ValidityChoice validity, std::vector<Partition>& partitions) const {
  Eigen::MatrixXd values(std::ssize(reservoir_.rows()), width());
  std::vector<int> others;
  std::vector<int> held_out;
  int at = 0;
  for (const auto& [hash, row] : reservoir_.rows()) {
    (row.held_out ? held_out : others).push_back(at);
    values.row(at++) = Eigen::Map<const Eigen::RowVectorXd>(row.values.data(), values.cols());
  }
  if (others.empty()) return;
  std::vector<int> all_inputs(inputs_);
  std::iota(all_inputs.begin(), all_inputs.end(), 0);
  const Table table{values.leftCols(inputs_),
                    values.middleCols(inputs_, outputs_),
                    values.rightCols(1),
                    std::vector<int>(inputs_, 0),
                    all_inputs,
                    all_inputs};
  TrainingRows training = training_rows(table, std::move(others));
  training.columns = inputs;
  training.regressors = regressors;
  const TrainingRows queries = query_rows(table, std::move(held_out), training);
  for (Partition& partition : partitions) {
    partition = choose(training, queries, std::move(partition), validity);
  }
}

}  // namespace llmt
