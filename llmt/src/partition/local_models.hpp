/// \file
/// The local models of a partition and their guards (docs/algorithms/guards.md), laid out for evaluation.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <vector>

#include "llmt/partition.hpp"

namespace llmt {

/// Deviation of the indicator of a level from its centre where the input is `x`; NaN where that is missing or unknown.
inline double indicator_deviation(double x, int level, double levels, double centre) {
  const double there = x == static_cast<double>(level) ? 1.0 - centre : 0.0 - centre;
  // Without a branch: levels of successive rows are unrelated, so a branch would often be predicted wrongly.
  return static_cast<int>(x >= 0.0) & static_cast<int>(x < levels) ? there : std::numeric_limits<double>::quiet_NaN();
}

/// Deviations of the regressors from their centres at one row of inputs; NaN where the input, or a factor of a product,
/// is missing or its level unknown.
void deviations_at(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors, const double* row,
                   double* deviations);

/// Some rows of a block and their validities.
struct RowList {
  const int* rows;
  const double* validities;
  Eigen::Index count;
};

/// Immutable after construction.
///
/// A sum over the regressors consists of four partial sums, (s_0 + s_2) + (s_1 + s_3), where s_l runs over the
/// regressors l, l + 4, l + 8, ...; the value is added last. This order holds on every machine, for single rows and for
/// blocks.
class LocalModels {
 public:
  LocalModels(const Partition& partition, Eigen::Index regressors);

  Eigen::Index num_outputs() const { return outputs_; }

  /// sums[o] += validity * f(x), where f is the guarded local model of the node for output o (B.2).
  void add(int node, double validity, const double* deviations, double* sums) const;

  /// Applies the guards B.3 and B.4 to `values`: holds them near the root's model, and goes on with the outer slopes
  /// beyond the root's range.
  void finish(const double* deviations, double* values) const;

  /// The two parts of finish(). hold() applies B.3 and returns whether the row lies in the root's range. beyond() gives
  /// d - c(root), by which a row that does not lie there is beyond it: one value for each regressor.
  bool hold(const double* deviations, double* values) const;
  void beyond(const double* deviations, double* by_regressor) const;

  /// The same for rows of a block: `deviations` as in RowBlock, `sums` rows x outputs, one row after the other.
  void add(int node, const RowList& list, const double* deviations, double* sums) const;
  void finish_rows(Eigen::Index rows, const double* deviations, double* values) const;

  /// by_regressor += validity * derivatives of add(), outputs x regressors.
  void add_slopes(int node, double validity, const double* deviations, Eigen::MatrixXd& by_regressor) const;

  /// Turns derivatives of `values` with respect to inputs and regressors into the derivatives of finish().
  void finish_slopes(const double* deviations, const double* values, Eigen::MatrixXd& by_input,
                     Eigen::MatrixXd& by_regressor) const;

 private:
  const double* low(int node) const { return data_.data() + node * (3 + outputs_) * stride_; }
  const double* high(int node) const { return low(node) + stride_; }
  const double* mean(int node) const { return low(node) + 2 * stride_; }
  const double* slopes(int node, Eigen::Index output) const { return low(node) + (3 + output) * stride_; }
  double value(int node, Eigen::Index output) const { return values_[node * outputs_ + output]; }
  const double* outer_slopes(Eigen::Index output) const { return outer_slopes_.data() + output * stride_; }

  template <class Row>
  bool sum_inside(int node, const Row& row, double& first) const;
  template <class Row>
  double sum(int node, Eigen::Index output, const Row& row) const;
  template <class Row>
  double guarded(int node, Eigen::Index output, const Row& row) const;
  template <class Row>
  double beyond_root(Eigen::Index output, const Row& row) const;
  template <class Row>
  void add_row(int node, double validity, const Row& row, double* sums) const;
  template <class Row>
  bool hold_row(const Row& row, double* values) const;
  template <class Row>
  void finish_row(const Row& row, double* values) const;

  Eigen::Index outputs_;
  Eigen::Index regressors_;
  Eigen::Index stride_;         // regressors, padded with zeros to whole quads
  std::vector<int> parents_;    // see parents_of()
  std::vector<double> data_;    // per node: low, high, mean, slopes of each output
  std::vector<double> values_;  // per node and output
  std::vector<double> outer_slopes_;
  Eigen::MatrixXd residual_range_;  // outputs x 2, widened; empty: no hold
};

}  // namespace llmt
