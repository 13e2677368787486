/// \file
/// What a model's file keeps of its training rows, so that new rows can be compared with them: see check.hpp.
///
///     const llmt::TrainingRecord& record = result.intervals.record();
///     const bool had_empty_cells = record.inputs[0].missing > 0;
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/partition.hpp"

namespace llmt {

/// How often which values of an input were among the training rows.
struct InputRecord {
  Eigen::Index missing = 0;  ///< rows without a value; those of a level for empty cells are of this level
  /// Of a number, ascending: the values that occur, or of more than most_recorded_values evenly spaced ones of the
  /// sorted rows. Empty for categories.
  std::vector<double> values = {};
  /// Rows that each of `values` stands for; of a category, rows of each level.
  std::vector<Eigen::Index> counts = {};

  Eigen::Index rows() const;                     ///< with a value
  bool empty() const { return counts.empty(); }  ///< nothing is known: no prediction uses the input
  bool operator==(const InputRecord&) const = default;
};

/// The largest number of values that a record has of an input.
inline constexpr Eigen::Index most_recorded_values = 100;

/// Held-out rows in a leaf of the model.
struct LeafRecord {
  Eigen::Index rows = 0;
  double mean_square = 0.0;  ///< of their residuals, each divided by the Spread at its row

  bool operator==(const LeafRecord&) const = default;
};

struct TrainingRecord {
  std::vector<InputRecord> inputs = {};              ///< one an input of the model
  std::vector<std::vector<LeafRecord>> leaves = {};  ///< of each output, as Model::leaves(); empty: not known
  /// What limited the size of the model: FitOptions::max_leaves or BoostOptions::max_rounds, given by the caller or
  /// found by a time limit. 0: their defaults.
  Eigen::Index size_limit = 0;

  bool empty() const { return inputs.empty(); }
  bool operator==(const TrainingRecord&) const = default;
};

/// The record of one input. `values`: of the rows, NaN where missing; categories as positions. `levels`: how many the
/// input has; 0: numbers. `copies`: how often each row counts; empty: once.
InputRecord record_of(const Eigen::Ref<const Eigen::VectorXd>& values, std::size_t levels,
                      const std::vector<int>& copies = {});

/// Throws std::invalid_argument if a record does not fit a model: another number of inputs or levels, values that do
/// not ascend or are not finite, another number of counts than of values, a count below 0, another number of outputs
/// than `outputs`, a square that is negative or not finite, a limit below 0.
void check_record(const TrainingRecord& record, const std::vector<InputColumn>& inputs, std::size_t outputs);

}  // namespace llmt
