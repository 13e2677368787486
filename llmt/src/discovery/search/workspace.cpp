#include "discovery/search/workspace.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace llmt::discovery {

Eigen::MatrixXd range_basis(const Eigen::MatrixXd& matrix, double tolerance) {
  // A column that is tiny next to the others is rounding. Scaled up it would be a direction of noise.
  constexpr double nothing = 1e-7;
  const double largest = matrix.cols() > 0 ? matrix.colwise().norm().maxCoeff() : 0.0;
  std::vector<Eigen::Index> moving;
  for (Eigen::Index k = 0; k < matrix.cols(); ++k) {
    if (matrix.col(k).norm() > nothing * largest) moving.push_back(k);
  }
  if (moving.empty()) return {matrix.rows(), 0};
  Eigen::MatrixXd scaled = matrix(Eigen::all, moving);
  scaled.colwise().normalize();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(scaled);
  factors.setThreshold(tolerance);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(matrix.rows(), factors.rank());
  basis.applyOnTheLeft(factors.householderQ());
  return basis;
}

Workspace::Workspace(const Evidence& evidence, const std::vector<EffectCandidate>& candidates,
                     double absorbed_tolerance)
    : components_(evidence.components),
      independent_share_(evidence.independent_share),
      clusters_(evidence.clusters),
      given_sum_of_squares_(evidence.residuals.squaredNorm()),
      residuals_(evidence.residuals) {
  constexpr double rounding = 1e-20;
  resolution_ = std::max(rounding, evidence.resolution);
  if (clusters_.empty()) {
    clusters_.resize(evidence.samples());
    std::iota(clusters_.begin(), clusters_.end(), Eigen::Index{0});
  }
  constexpr double rank_tolerance = 1e-9;
  baseline_ = range_basis(evidence.jacobian, rank_tolerance);
  degrees_ = static_cast<double>(residuals_.size() - baseline_.cols());
  project(residuals_);
  Eigen::Index columns = 0;
  for (const EffectCandidate& candidate : candidates) {
    columns += candidate.signature.cols();
    corrections_.push_back(candidate.moment_correction);
  }
  Eigen::MatrixXd all(residuals_.size(), columns);
  columns = 0;
  for (const EffectCandidate& candidate : candidates) {
    all.middleCols(columns, candidate.signature.cols()) = candidate.signature;
    columns += candidate.signature.cols();
  }
  project(all);
  basis_.resize(residuals_.size(), columns);
  Eigen::Index next = 0;
  columns = 0;
  for (const EffectCandidate& candidate : candidates) {
    add(candidate, all.middleCols(columns, candidate.signature.cols()), absorbed_tolerance, next);
    columns += candidate.signature.cols();
  }
  basis_.conservativeResize(Eigen::NoChange, next);
  gram_ = Eigen::MatrixXd::Zero(next, next);
  if (next > 0) gram_.selfadjointView<Eigen::Lower>().rankUpdate(basis_.transpose());
  gram_.triangularView<Eigen::StrictlyUpper>() = gram_.transpose();
  set_moments();
}

// Directions of the candidate's values are ordered by how much of them is outside; those with too little are absorbed.
void Workspace::add(const EffectCandidate& candidate, Eigen::MatrixXd projected, double absorbed_tolerance,
                    Eigen::Index& next) {
  Block block{.begin = next, .size = 0, .to_values = {}, .outside = 0.0};
  const Eigen::Index k = candidate.signature.cols();
  Eigen::VectorXd norms = candidate.signature.colwise().norm();
  // A parameter that does nothing next to the others, at its largest plausible value, is rounding.
  constexpr double nothing = 1e-7;
  Eigen::VectorXd reach = norms;
  if (candidate.lower.size() != 0)
    reach.array() *= candidate.lower.cwiseAbs().cwiseMax(candidate.upper.cwiseAbs()).array();
  const double largest = reach.maxCoeff();
  for (Eigen::Index i = 0; i < k; ++i) {
    if (!(reach(i) > nothing * largest)) norms(i) = 0.0;
  }
  Eigen::VectorXd scale(k);
  for (Eigen::Index i = 0; i < k; ++i) scale(i) = norms(i) > 0.0 ? 1.0 / norms(i) : 0.0;
  projected = projected * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> outside(projected.transpose() * projected);
  const Eigen::Index moving = (norms.array() > 0.0).count();
  block.outside =
      moving > 0 ? std::sqrt(std::max(0.0, outside.eigenvalues().sum() / static_cast<double>(moving))) : 0.0;
  const double smallest = absorbed_tolerance * absorbed_tolerance;
  for (Eigen::Index i = k - 1; i >= 0 && outside.eigenvalues()(i) > smallest; --i) ++block.size;
  // Rounding of the projection is all that is left of what is absorbed exactly.
  const Eigen::VectorXd roots = outside.eigenvalues().tail(block.size).cwiseSqrt();
  const Eigen::MatrixXd whiten = outside.eigenvectors().rightCols(block.size) * roots.cwiseInverse().asDiagonal();
  basis_.middleCols(next, block.size) = projected * whiten;
  block.to_values = scale.asDiagonal() * whiten;
  next += block.size;
  blocks_.push_back(std::move(block));
}

void Workspace::project(Eigen::Ref<Eigen::MatrixXd> columns) const {
  const Eigen::MatrixXd inside = baseline_.transpose() * columns;
  columns.noalias() -= baseline_ * inside;
}

void Workspace::drop(const std::vector<std::size_t>& samples) {
  if (samples.empty()) return;
  for (const std::size_t sample : samples) {
    const Eigen::Index first = sample * components_;
    Eigen::MatrixXd shift = Eigen::MatrixXd::Zero(residuals_.size(), components_);
    shift.middleRows(first, components_).setIdentity();
    project(shift);
    const Eigen::MatrixXd directions = range_basis(shift, 1e-6);
    const Eigen::MatrixXd of_basis = directions.transpose() * basis_;
    basis_.noalias() -= directions * of_basis;
    residuals_ -= directions * (directions.transpose() * residuals_);
    gram_.noalias() -= of_basis.transpose() * of_basis;
    baseline_.conservativeResize(Eigen::NoChange, baseline_.cols() + directions.cols());
    baseline_.rightCols(directions.cols()) = directions;
    dropped_.push_back(sample);
  }
  orthonormalise_blocks();
  set_moments();
}

void Workspace::set_moments() {
  moments_ = basis_.transpose() * residuals_;
  uncorrected_moments_.resize(0);
  for (std::size_t a = 0; a < blocks_.size(); ++a) {
    const Block& block = blocks_[a];
    if (corrections_[a].size() == 0 || block.size == 0) continue;
    if (uncorrected_moments_.size() == 0) uncorrected_moments_ = moments_;
    moments_.segment(block.begin, block.size) += block.to_values.transpose() * corrections_[a];
  }
}

void Workspace::orthonormalise_blocks() {
  for (Block& block : blocks_) {
    if (block.size == 0) continue;
    const Eigen::MatrixXd own = gram_.block(block.begin, block.begin, block.size, block.size);
    const Eigen::LLT<Eigen::MatrixXd> factor(own);
    const Eigen::MatrixXd lower = factor.matrixL();
    constexpr double lost = 1e-6;  // the candidate lived on the dropped samples
    if (factor.info() != Eigen::Success || lower.diagonal().minCoeff() < lost) {
      basis_.middleCols(block.begin, block.size).setZero();
      gram_.middleCols(block.begin, block.size).setZero();
      gram_.middleRows(block.begin, block.size).setZero();
      gram_.block(block.begin, block.begin, block.size, block.size).setIdentity();
      continue;
    }
    const auto solve_right = [&](auto&& columns) {
      const Eigen::MatrixXd solved = factor.matrixL().solve(columns.transpose()).transpose();
      columns = solved;
    };
    solve_right(basis_.middleCols(block.begin, block.size));
    solve_right(block.to_values);
    solve_right(gram_.middleCols(block.begin, block.size));
    const Eigen::MatrixXd rows = factor.matrixL().solve(gram_.middleRows(block.begin, block.size));
    gram_.middleRows(block.begin, block.size) = rows;
  }
}

}  // namespace llmt::discovery
