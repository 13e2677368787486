// Residuals and signatures with everything projected out that the baseline can imitate.
#pragma once

#include <vector>

#include "llmt/discovery/verdict.hpp"

namespace llmt::discovery {

/// The part of one candidate that the baseline cannot imitate: columns of the workspace's basis.
struct Block {
  Eigen::Index begin = 0;
  Eigen::Index size = 0;      ///< 0: absorbed
  Eigen::MatrixXd to_values;  ///< k x size: values = to_values * coefficients
  double outside = 0.0;       ///< Sensitivity::outside
};

/// r, U: residuals and an orthonormal basis of every candidate's signature, both orthogonal to the baseline's range;
/// G = U'U and c = U'r (and EffectCandidate::moment_correction), from which any set of candidates is a small solve.
class Workspace {
 public:
  Workspace(const Evidence& evidence, const std::vector<EffectCandidate>& candidates, double absorbed_tolerance);

  /// Leaves samples out by projecting out a free shift of each: d more directions per sample.
  void drop(const std::vector<std::size_t>& samples);

  const std::vector<Block>& blocks() const { return blocks_; }
  const Eigen::MatrixXd& basis() const { return basis_; }
  const Eigen::MatrixXd& gram() const { return gram_; }
  const Eigen::VectorXd& moments() const { return moments_; }
  /// U'r, where moments() holds corrections; else empty.
  const Eigen::VectorXd& uncorrected_moments() const { return uncorrected_moments_; }
  const Eigen::VectorXd& residuals() const { return residuals_; }
  const Eigen::MatrixXd& baseline() const { return baseline_; }
  const std::vector<std::size_t>& dropped() const { return dropped_; }
  Eigen::Index components() const { return components_; }
  Eigen::Index samples() const { return residuals_.size() / components_; }
  /// n d - rank of the Jacobian, dropped samples not counted off.
  double degrees() const { return degrees_; }
  /// Those that the dropped samples take: a degree for each component.
  double dropped_degrees() const { return static_cast<double>(std::ssize(dropped_) * components_); }
  double sum_of_squares() const { return residuals_.squaredNorm(); }
  /// Evidence::resolution, or the share that rounding errors reach if that is larger.
  double resolution() const { return resolution_; }
  /// Evidence::independent_share.
  double independent_share() const { return independent_share_; }
  /// Evidence::clusters, or a number of its own for each sample.
  const std::vector<Eigen::Index>& clusters() const { return clusters_; }
  /// Sum of squares of the residuals as given, before the baseline is adjusted: rounding errors are relative to it.
  double given_sum_of_squares() const { return given_sum_of_squares_; }
  /// Subtracts from every column its part in the range of the baseline.
  void project(Eigen::Ref<Eigen::MatrixXd> columns) const;

 private:
  Eigen::Index components_;
  double degrees_ = 0.0;
  double resolution_ = 0.0;
  double independent_share_ = 1.0;
  std::vector<Eigen::Index> clusters_;
  double given_sum_of_squares_ = 0.0;
  Eigen::MatrixXd baseline_;  // N x m, orthonormal; dropped samples included
  Eigen::VectorXd residuals_;
  Eigen::MatrixXd basis_;
  Eigen::MatrixXd gram_;
  Eigen::VectorXd moments_;
  Eigen::VectorXd uncorrected_moments_;
  std::vector<Block> blocks_;
  std::vector<Eigen::VectorXd> corrections_;  // EffectCandidate::moment_correction
  std::vector<std::size_t> dropped_;

  void add(const EffectCandidate& candidate, Eigen::MatrixXd projected, double absorbed_tolerance, Eigen::Index& next);
  void orthonormalise_blocks();
  void set_moments();
};

/// Orthonormal basis of the range of a matrix whose columns may have any scale: columns with less than `tolerance` of
/// their norm outside the earlier ones are dependent.
Eigen::MatrixXd range_basis(const Eigen::MatrixXd& matrix, double tolerance);

}  // namespace llmt::discovery
