/// \file
/// A partition laid out for evaluation: which leaves reach a point, and what they say there.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// Over this fraction of a range the hold at its ends sets in.
inline constexpr double rounding_of_hold = 0.1;

/// A row without a value for a split teaches a child if that has at least this share of it.
inline constexpr double clear_share = 0.9;

/// A leaf that reaches a point.
struct Activation {
  int node = 0;
  double validity = 0.0;
};

/// Deviations of the regressors from their centres at one row of inputs; NaN where the input is missing or its level
/// unknown.
void deviations_at(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors, const double* row,
                   double* deviations);

/// Deviation of one regressor where its input is x.
double deviation_at(const std::vector<InputColumn>& inputs, const Regressor& regressor, double x);

/// Sets Node::half_width of a partition for its validity: the boxes are closed by `low` and `high`, one per input.
void set_half_widths(Partition& partition, const Eigen::VectorXd& low, const Eigen::VectorXd& high);

/// See Model for what it computes. Immutable after construction.
class Evaluator {
 public:
  /// `inputs`: columns of the model, whose extents close the boxes.
  Evaluator(const Partition& partition, const std::vector<InputColumn>& inputs, std::ptrdiff_t regressors);

  /// The leaves whose validity at the inputs `row` is positive; validities sum to 1.
  void activate(const double* row, std::vector<Activation>& active) const;

  /// Local model of a node, one value per output, with its ancestors' slopes beyond the node's range and none beyond
  /// the root's.
  void local(int node, const double* deviations, double* values) const;

  /// Holds values near the root's model and goes on beyond the root's range.
  void finish(const double* deviations, double* values) const;

  /// The prediction: sum of validity times local model, finished.
  void combine(const std::vector<Activation>& active, const double* deviations, double* values) const;

  /// Derivatives of all outputs at a point without missing values: with respect to the inputs at fixed local models
  /// and to the regressors at fixed validities.
  void derivatives(const double* row, const double* deviations, Eigen::MatrixXd& by_input,
                   Eigen::MatrixXd& by_regressor) const;

  /// Validity of the left child at a split, and its derivative with respect to the split input.
  double left_share(int node, const double* row) const;
  double left_share_derivative(int node, const double* row) const;

  /// Node of the leaf whose box holds the row; missing values go where the larger share goes.
  int find_leaf(const double* row) const;

  /// Whether a missing value sends the row to both sides of some split in earnest.
  bool is_ambiguous(const double* row) const;
  int child_of(int node, const double* row) const;

  std::ptrdiff_t num_outputs() const { return outputs_; }

 private:
  struct Branch {
    int left = -1;
    int right = -1;
    int input = -1;
    double threshold = 0.0;
    double per_half_width = 0.0;  // 1 / h; 0: a jump
    double half_width = 0.0;
    double missing_left = 0.5;
    int first_level = -1;  // of this split's entries in level_side_; -1: a number
    int levels = 0;
  };
  struct Gaussian {
    int node = 0;
    Eigen::VectorXd centre;
    Eigen::VectorXd per_sigma;  // 1 / sigma; 0 for an input without extent, or categorical
  };

  const double* low(int node) const { return ranges_.data() + 3 * node * regressors_; }
  const double* high(int node) const { return low(node) + regressors_; }
  const double* mean(int node) const { return high(node) + regressors_; }
  const double* slopes(int node, std::ptrdiff_t output) const {
    return coefficients_.data() + (node * outputs_ + output) * (regressors_ + 1) + 1;
  }
  double value(int node, std::ptrdiff_t output) const { return slopes(node, output)[-1]; }
  double root_value(std::ptrdiff_t output, const double* deviations) const;
  void guarded(int node, const double* deviations, double* values) const;
  void local_slopes(int node, const double* deviations, double validity, Eigen::MatrixXd& by_regressor) const;
  void add_gaussian_derivatives(const std::vector<Activation>& active, const double* row, const double* deviations,
                                Eigen::MatrixXd& by_input) const;
  Eigen::VectorXd add_blend_derivatives(int node, double validity, const double* row, const double* deviations,
                                        Eigen::MatrixXd& by_input) const;
  void blend(const std::vector<Activation>& active, const double* deviations, double* values) const;

  ValidityKind kind_;
  int smoothness_;
  std::ptrdiff_t outputs_;
  std::ptrdiff_t regressors_;
  std::ptrdiff_t inputs_;
  std::vector<Branch> branches_;
  std::vector<int> parents_;
  std::vector<int> level_side_;
  std::vector<double> coefficients_;  // per node and output: value, slopes
  std::vector<double> ranges_;        // per node: low, high, mean
  Eigen::MatrixXd residual_range_;    // outputs x 2, widened; empty: no hold
  Eigen::MatrixXd outer_slope_;
  std::vector<Gaussian> gaussians_;
};

/// Undoes the split of a node.
void make_leaf(Node& node);

/// Parent of every node, -1 for the root.
std::vector<int> parents_of(const Partition& partition);

/// Boxes of all nodes, inputs x nodes each, cut out of low ... high by the splits on numbers.
struct Boxes {
  Eigen::MatrixXd low;
  Eigen::MatrixXd high;
};
Boxes boxes_of(const Partition& partition, const Eigen::VectorXd& low, const Eigen::VectorXd& high);

}  // namespace llmt
