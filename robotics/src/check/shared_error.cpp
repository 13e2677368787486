#include "check/shared_error.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace llmt::robotics {
namespace {

Eigen::MatrixXd factor_of(const SharedError& shared, const Eigen::MatrixXd& places) {
  Eigen::MatrixXd all = Eigen::MatrixXd::Identity(places.cols(), places.cols());
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    for (Eigen::Index k = 0; k < i; ++k) {
      all(i, k) = all(k, i) = shared.share * std::exp(-(places.col(i) - places.col(k)).norm() / shared.range);
    }
  }
  return all.llt().matrixL();
}

void solve(const Eigen::MatrixXd& factor, const PointStretch& stretch, Eigen::MatrixXd& rows) {
  for (const std::vector<Eigen::Index>& axis : stretch.of_axis) {
    Eigen::MatrixXd own = rows(axis, Eigen::all);
    factor.triangularView<Eigen::Lower>().solveInPlace(own);
    rows(axis, Eigen::all) = own;
  }
}

// -2 log of the restricted likelihood, less what does not depend on the correlations. What poses have in common is part
// of the errors that calibration knew; only independent noise may have grown.
double badness(SharedError& shared, const PointRows& points, const Eigen::MatrixXd& jacobian,
               const Eigen::VectorXd& residuals, double known) {
  Eigen::MatrixXd columns = jacobian;
  Eigen::MatrixXd right = residuals;
  double determinant = 0.0;
  if (shared.share > 0.0) {
    for (const PointStretch& stretch : points) {
      const Eigen::MatrixXd factor = factor_of(shared, stretch.places);
      const auto axes = static_cast<double>(stretch.of_axis.size());
      determinant += 2.0 * axes * factor.diagonal().array().log().sum();
      solve(factor, stretch, columns);
      solve(factor, stretch, right);
    }
  }
  const Eigen::HouseholderQR<Eigen::MatrixXd> factors(columns);
  const Eigen::MatrixXd rotated = factors.householderQ().adjoint() * right;
  const Eigen::Index freedom = rotated.rows() - columns.cols();
  const double squares = rotated.bottomRows(freedom).squaredNorm();
  determinant += 2.0 * factors.matrixQR().diagonal().array().abs().log().sum();
  shared.sigma = known;
  if (shared.share == 0.0) shared.sigma = std::max(known, std::sqrt(squares / static_cast<double>(freedom)));
  return determinant + static_cast<double>(freedom) * 2.0 * std::log(shared.sigma) +
         squares / (shared.sigma * shared.sigma);
}

// Independent columns that span those of the Jacobian.
Eigen::MatrixXd span_of(Eigen::MatrixXd columns) {
  for (auto column : columns.colwise()) column.stableNormalize();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(columns);
  factors.setThreshold(1e-7);
  return factors.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), factors.rank());
}

// A column for each pose.
Eigen::MatrixXd places_of(const Chain& chain, const Eigen::MatrixXd& joints) {
  const double reach = std::max(1.0, reach_of(chain));
  Eigen::MatrixXd places = Eigen::MatrixXd::Zero(2 * joints.cols(), joints.rows());
  for (Eigen::Index j = 0; j < joints.cols(); ++j) {
    if (chain.joints[j].type == JointType::revolute) {
      places.row(2 * j) = joints.col(j).array().cos().transpose();
      places.row(2 * j + 1) = joints.col(j).array().sin().transpose();
    } else {
      places.row(2 * j) = joints.col(j).transpose() / reach;
    }
  }
  return places;
}

}  // namespace

PointRows point_rows(const Chain& chain, const Measurements& measurements, const std::vector<Eigen::Index>& rows,
                     Eigen::Index longest) {
  const std::vector<Observation>& seen = measurements.poses.observations;
  const Eigen::MatrixXd places = places_of(chain, measurements.poses.joints);
  PointRows stretches;
  std::vector<Eigen::Index> poses;
  const auto close = [&] {
    if (poses.empty()) return;
    std::erase_if(stretches.back().of_axis, [](const auto& axis) { return axis.empty(); });
    stretches.back().places = places(Eigen::all, poses);
    poses.clear();
  };
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Eigen::Index pose = rows[k] / 3;
    if (!seen.empty() && seen[pose].reading != Reading::position) continue;
    if (poses.empty() || poses.back() != pose) {
      if (std::ssize(poses) == longest) close();
      if (poses.empty()) stretches.push_back({.of_axis = std::vector<std::vector<Eigen::Index>>(3), .places = {}});
      poses.push_back(pose);
    }
    stretches.back().of_axis[rows[k] % 3].push_back(static_cast<Eigen::Index>(k));
  }
  close();
  return stretches;
}

SharedError likeliest_shared_error(const PointRows& points, const Eigen::MatrixXd& jacobian,
                                   const Eigen::VectorXd& residuals, double known) {
  const Eigen::MatrixXd span = span_of(jacobian);
  SharedError best{.sigma = known};
  if (!(known > 0.0) || span.rows() <= span.cols() || points.empty()) return best;
  double least = badness(best, points, span, residuals, known);
  for (const double share : {0.25, 0.5, 0.75, 0.9, 0.98}) {
    for (const double range : {0.1, 0.2, 0.4, 0.8, 1.6, 3.2}) {
      SharedError tried{.share = share, .range = range};
      const double now = badness(tried, points, span, residuals, known);
      if (now >= least) continue;
      least = now;
      best = tried;
    }
  }
  return best;
}

Eigen::MatrixXd whitened(const SharedError& shared, const PointRows& points, Eigen::MatrixXd rows) {
  if (shared.share == 0.0) return rows;
  for (const PointStretch& stretch : points) solve(factor_of(shared, stretch.places), stretch, rows);
  return rows;
}

Eigen::MatrixXd coloured(const SharedError& shared, const PointRows& points, Eigen::MatrixXd rows) {
  if (shared.share == 0.0) return rows;
  for (const PointStretch& stretch : points) {
    const Eigen::MatrixXd factor = factor_of(shared, stretch.places);
    for (const std::vector<Eigen::Index>& axis : stretch.of_axis) {
      const Eigen::MatrixXd own = rows(axis, Eigen::all);
      rows(axis, Eigen::all) = factor.triangularView<Eigen::Lower>() * own;
    }
  }
  return rows;
}

}  // namespace llmt::robotics
