#include "discovery/investigation/leave_one_out.hpp"

#include <algorithm>

#include "calibration/free_parameters.hpp"
#include "discovery/investigation/jacobian_range.hpp"
#include "discovery/investigation/pose_split.hpp"
#include "linear_algebra/linear_algebra.hpp"

namespace llmt::robotics {

Eigen::VectorXd leave_one_out_distances(const Eigen::MatrixXd& used, const Eigen::VectorXd& errors, Eigen::Index d) {
  Eigen::VectorXd lengths(errors.size() / d);
  for (Eigen::Index i = 0; i < lengths.size(); ++i) {
    Eigen::MatrixXd own = identity_minus_gram(used.middleCols(i * d, d));
    own.diagonal().array() += 1e-6;
    lengths(i) = solve_symmetric(own, errors.segment(i * d, d)).norm();
  }
  return lengths;
}

Eigen::VectorXd leave_one_out_distances(const Calibration& fitted, const Measurements& measurements,
                                        const std::vector<std::size_t>& skipped) {
  const Measurements kept = without_rows(measurements, skipped);
  const std::vector<Eigen::Index> free = freed_parameters(fitted.robot);
  const std::vector<Eigen::Index> rows = measured_rows(kept);
  const Eigen::MatrixXd basis = range_of(rows_of(position_jacobian(fitted.robot, kept.poses, free), rows));
  const Eigen::MatrixXd model = positions(fitted.robot, kept.poses);
  Eigen::VectorXd errors(std::ssize(rows));
  for (Eigen::Index k = 0; k < errors.size(); ++k) {
    errors(k) = kept.positions_mm(rows[k] / 3, rows[k] % 3) - model(rows[k] / 3, rows[k] % 3);
  }
  const Eigen::VectorXd seen =
      leave_one_out_distances(basis.transpose(), errors, std::ranges::count(kept.measured, true));
  Eigen::VectorXd all = distances(positions(fitted.robot, measurements.poses), measurements);
  Eigen::Index next = 0;
  for (Eigen::Index i = 0; i < all.size(); ++i) {
    if (!std::ranges::binary_search(skipped, static_cast<std::size_t>(i))) all(i) = seen(next++);
  }
  return all;
}

}  // namespace llmt::robotics
