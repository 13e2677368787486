/// \file
/// A partition laid out for evaluation.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/partition.hpp"
#include "partition/leaf_validities.hpp"
#include "partition/local_models.hpp"
#include "partition/row_block.hpp"
#include "partition/tree.hpp"

namespace llmt {

/// See Model for what it computes. Immutable after construction. A row gives the same bytes alone and in a block.
class Evaluator {
 public:
  /// `inputs`: columns of the model, whose extents close the boxes.
  Evaluator(const Partition& partition, const std::vector<InputColumn>& inputs, Eigen::Index regressors)
      : inputs_(std::ssize(inputs)),
        regressors_(regressors),
        validities_(partition, inputs),
        models_(partition, regressors),
        output_range_(partition.output_range) {}

  const LeafValidities& validities() const { return validities_; }
  Eigen::Index num_outputs() const { return models_.num_outputs(); }

  /// See LeafValidities.
  void activate(const double* row, std::vector<Activation>& active) const { validities_.activate(row, active); }
  double left_share(int node, const double* row) const { return validities_.left_share(node, row); }
  bool is_ambiguous(const double* row) const { return validities_.is_ambiguous(row); }
  int child_of(int node, const double* row) const { return validities_.child_of(node, row); }

  /// Guarded local model of a node (docs/algorithms/guards.md, B.2), one value per output.
  void local(int node, const double* deviations, double* values) const;

  /// Applies the guards B.3 and B.4 of docs/algorithms/guards.md to `values`.
  void finish(const double* deviations, double* values) const { models_.finish(deviations, values); }

  /// See LocalModels.
  bool hold(const double* deviations, double* values) const { return models_.hold(deviations, values); }
  void beyond(const double* deviations, double* by_regressor) const { models_.beyond(deviations, by_regressor); }

  /// The prediction (docs/algorithms/model.md, M.2) with its guards: sum of validity times local model, finished, and
  /// clamped (B.5).
  void combine(const std::vector<Activation>& active, const double* deviations, double* values) const;

  /// The two parts of combine().
  void combine_unclamped(const std::vector<Activation>& active, const double* deviations, double* values) const;
  void clamp(double* values) const;

  /// See Partition.
  const Eigen::MatrixXd& output_range() const { return output_range_; }
  bool has_output_range() const { return output_range_.size() > 0; }

  /// Predictions of a block, rows x outputs of the partition, one row after the other.
  void predict(const RowBlock& block, std::vector<double>& values) const;

  /// Derivatives of all outputs at a point without missing values: with respect to the inputs at fixed local models
  /// and to the regressors at fixed validities.
  void derivatives(const double* row, const double* deviations, Eigen::MatrixXd& by_input,
                   Eigen::MatrixXd& by_regressor) const;

 private:
  void add_gaussian_derivatives(const double* row, const double* deviations, double* values, Eigen::MatrixXd& by_input,
                                Eigen::MatrixXd& by_regressor) const;
  void add_blend_derivatives(const double* row, const double* deviations, std::vector<double>& values,
                             Eigen::MatrixXd& by_input, Eigen::MatrixXd& by_regressor) const;

  Eigen::Index inputs_;
  Eigen::Index regressors_;
  LeafValidities validities_;
  LocalModels models_;
  Eigen::MatrixXd output_range_;
};

}  // namespace llmt
