#include "discovery/judges/residual_tests.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "calibration/free_parameters.hpp"
#include "discovery/investigation/pose_split.hpp"
#include "linear_algebra/linear_algebra.hpp"
#include "llmt/random.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

constexpr int draws = 200;
constexpr double surprising = 4.5;   // standard deviations
constexpr Eigen::Index fewest = 20;  // samples to test

// Residual vectors, one a row, and the part of other vectors that the same fit would leave.
struct Residuals {
  Eigen::MatrixXd vectors;  // n x d
  Eigen::MatrixXd basis;    // n d x rank, orthonormal: the range of the Jacobian
  Eigen::Index count() const { return vectors.rows(); }
  Eigen::Index components() const { return vectors.cols(); }

  Eigen::MatrixXd after_fit(const Eigen::MatrixXd& given) const {
    const Eigen::MatrixXd by_sample = given.transpose();
    Eigen::VectorXd stacked = by_sample.reshaped();
    remove_range(basis, stacked);
    return stacked.reshaped(components(), count()).transpose();
  }
};

// Poses that were measured several times count once: the common part of repeats need not be noise.
Measurements once_each(const Measurements& measurements) {
  const std::vector<Eigen::Index> repeats = repeats_of(measurements.poses);
  if (repeats.empty()) return measurements;
  std::map<Eigen::Index, std::vector<Eigen::Index>> groups;
  for (Eigen::Index i = 0; i < measurements.count(); ++i) groups[repeats[i]].push_back(i);
  std::vector<Eigen::Index> first;
  for (const auto& [number, rows] : groups) first.push_back(rows.front());
  std::ranges::sort(first);
  Measurements single = select(measurements, first);
  for (Eigen::Index k = 0; k < std::ssize(first); ++k) {
    const std::vector<Eigen::Index>& rows = groups[repeats[first[k]]];
    single.positions_mm.row(k) = mean_reading(measurements, rows);
  }
  return single;
}

std::vector<Eigen::Index> axes_of(const Measurements& measurements) {
  std::vector<Eigen::Index> axes;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (measurements.measured[axis]) axes.push_back(axis);
  }
  return axes;
}

Residuals residuals_of(const Calibration& fitted, const Measurements& measurements) {
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  const std::vector<Eigen::Index> free = freed_parameters(fitted.robot);
  Eigen::MatrixXd jacobian = rows_of(position_jacobian(fitted.robot, measurements.poses, free), rows);
  normalize_columns(jacobian);
  Residuals residuals;
  residuals.basis = orthonormal_range(jacobian);
  const Eigen::MatrixXd model = positions(fitted.robot, measurements.poses);
  residuals.vectors = columns_of(measurements.positions_mm - model, axes_of(measurements));
  return residuals;
}

// Unit vectors of the motion by a joint at every pose; zero where it moves nothing.
Eigen::MatrixXd motions(const Robot& robot, const Measurements& measurements, Eigen::Index joint) {
  const Eigen::MatrixXd all = joint_motions(robot, measurements.poses);
  const std::vector<Eigen::Index> axes = axes_of(measurements);
  Eigen::MatrixXd units(measurements.count(), std::ssize(axes));
  for (Eigen::Index i = 0; i < units.rows(); ++i) {
    const Eigen::VectorXd lever = all.middleRows(3 * i, 3)(axes, joint);
    units.row(i).setZero();
    if (lever.norm() > 1e-6) units.row(i) = lever.normalized().transpose();
  }
  return units;
}

// Rotations into distance, azimuth and elevation from the origin, or none.
std::vector<Eigen::Matrix3d> instrument_axes(const Measurements& measurements) {
  std::vector<Eigen::Matrix3d> turned;
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    const Eigen::Vector3d point = measurements.positions_mm.row(i).transpose();
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    if (point.head(2).norm() > 1e-9) {
      const Eigen::Vector3d out = point.normalized();
      const Eigen::Vector3d round = Eigen::Vector3d(-point.y(), point.x(), 0.0).normalized();
      axes << out.transpose(), round.transpose(), out.cross(round).transpose();
    }
    turned.push_back(axes);
  }
  return turned;
}

// True if the positions come with distances and directions from an instrument.
bool has_polar_axes(const Residuals& residuals, const Measurements& measurements) {
  return residuals.components() == 3 && has_instrument(measurements.poses);
}

double spread(const std::vector<double>& values, double& mean) {
  const auto n = static_cast<double>(values.size());
  mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / (n - 1.0));
}

// Random vectors with the lengths of the residuals; their directions follow the residuals' covariance in the axes given
// (empty: the world's).
Eigen::MatrixXd random_like(const Residuals& residuals, const std::vector<Eigen::Matrix3d>& axes, Random& random) {
  const Eigen::Index d = residuals.components();
  Eigen::MatrixXd local = residuals.vectors;
  for (std::size_t i = 0; i < axes.size(); ++i) local.row(i) = (axes[i] * local.row(i).transpose()).transpose();
  Eigen::MatrixXd covariance = gram(local);
  covariance.diagonal().array() += 1e-9 * covariance.trace();
  const Eigen::MatrixXd root = Cholesky(covariance).lower();
  Eigen::MatrixXd drawn(residuals.count(), d);
  for (Eigen::Index i = 0; i < drawn.rows(); ++i) {
    Eigen::VectorXd normal(d);
    for (double& value : normal) value = random.normal();
    Eigen::VectorXd vector = product(root, normal).normalized() * residuals.vectors.row(i).norm();
    if (!axes.empty()) vector = axes[i].transpose() * vector;
    drawn.row(i) = vector.transpose();
  }
  return residuals.after_fit(drawn);
}

double share_along(const Eigen::MatrixXd& vectors, const Eigen::MatrixXd& units) {
  return vectors.cwiseProduct(units).rowwise().sum().squaredNorm() / vectors.squaredNorm();
}

std::optional<ResidualStructure> test_directions(const Residuals& residuals, const Calibration& fitted,
                                                 const Measurements& measurements, Random& random) {
  const std::vector<Joint>& joints = fitted.robot.chain.joints;
  std::vector<Eigen::MatrixXd> units;
  for (std::size_t j = 0; j < joints.size(); ++j) units.push_back(motions(fitted.robot, measurements, j));
  std::vector<double> smallest(joints.size(), std::numeric_limits<double>::infinity());
  std::vector<std::vector<Eigen::Matrix3d>> kinds = {{}};
  if (has_polar_axes(residuals, measurements)) kinds.push_back(instrument_axes(measurements));
  for (const std::vector<Eigen::Matrix3d>& axes : kinds) {
    std::vector<std::vector<double>> shares(joints.size());
    for (int draw = 0; draw < draws; ++draw) {
      const Eigen::MatrixXd vectors = random_like(residuals, axes, random);
      for (std::size_t j = 0; j < joints.size(); ++j) shares[j].push_back(share_along(vectors, units[j]));
    }
    for (std::size_t j = 0; j < joints.size(); ++j) {
      double mean = 0.0;
      const double error = spread(shares[j], mean);
      const double beyond = error > 0.0 ? (share_along(residuals.vectors, units[j]) - mean) / error : 0.0;
      smallest[j] = std::min(smallest[j], beyond);
    }
  }
  const auto worst = std::ranges::max_element(smallest);
  if (*worst < surprising) return std::nullopt;
  const std::size_t j = worst - smallest.begin();
  return ResidualStructure{joints[j].name,
                           fmt::format("{:.0f} % of the square of what is left lies along the motion of {}: an "
                                       "instrument scatters in all directions, a joint in one",
                                       100.0 * share_along(residuals.vectors, units[j]), joints[j].name)};
}

// Sum of products of neighbours in the order given.
double likeness(const Eigen::MatrixXd& vectors, const std::vector<Eigen::Index>& order) {
  double sum = 0.0;
  for (std::size_t k = 0; k + 1 < order.size(); ++k) sum += vectors.row(order[k]).dot(vectors.row(order[k + 1]));
  return sum;
}

bool neighbours_are_alike(const Eigen::MatrixXd& vectors, const Eigen::VectorXd& by, Random& random) {
  std::vector<Eigen::Index> order(vectors.rows());
  std::iota(order.begin(), order.end(), 0);
  const std::vector<Eigen::Index> rows = order;
  std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return by(i); });
  const double own = likeness(vectors, order);
  if (!(own > 0.0)) return false;
  // Before any draws: the sum's standard deviation is about |v|^2 / sqrt(n).
  const double scale = vectors.rowwise().squaredNorm().sum() / std::sqrt(static_cast<double>(vectors.rows()));
  if (own < 2.0 * scale) return false;
  std::vector<double> others;
  for (int draw = 0; draw < draws; ++draw) others.push_back(likeness(vectors, random.permutation(vectors.rows())));
  double mean = 0.0;
  const double error = spread(others, mean);
  return own > mean + surprising * error;
}

const Eigen::VectorXd* session_order(const Poses& poses) {
  for (const char* name : {"order", "time_s"}) {
    const auto found = poses.covariates.find(name);
    if (found != poses.covariates.end()) return &found->second;
  }
  return nullptr;
}

std::optional<ResidualStructure> test_neighbours(const Residuals& residuals, const Calibration& fitted,
                                                 const Measurements& measurements, Random& random) {
  // A single long vector would decide the sum.
  Eigen::MatrixXd vectors = residuals.vectors;
  const double longest = 3.0 * std::sqrt(vectors.squaredNorm() / static_cast<double>(vectors.rows()));
  for (auto row : vectors.rowwise()) {
    if (row.norm() > longest) row *= longest / row.norm();
  }
  const Eigen::VectorXd* order = session_order(measurements.poses);
  const Eigen::VectorXd rows = Eigen::VectorXd::LinSpaced(vectors.rows(), 0.0, 1.0);
  if (neighbours_are_alike(vectors, order != nullptr ? *order : rows, random)) {
    return ResidualStructure{"session",
                             fmt::format("what is left is alike in neighbours by {}: something changes slowly",
                                         order != nullptr ? "order of measuring" : "row of the file")};
  }
  if (has_polar_axes(residuals, measurements)) {
    const std::vector<Eigen::Matrix3d> axes = instrument_axes(measurements);
    Eigen::MatrixXd local = vectors;
    for (Eigen::Index i = 0; i < local.rows(); ++i) local.row(i) = (axes[i] * vectors.row(i).transpose()).transpose();
    // The model's positions: in an order by the measured ones, neighbours would be alike by their noise.
    const Eigen::MatrixXd p = positions(fitted.robot, measurements.poses);
    const std::array<std::pair<const char*, Eigen::VectorXd>, 3> inputs = {
        {{"azimuth", p.col(1).binaryExpr(p.col(0), [](double y, double x) { return std::atan2(y, x); })},
         {"elevation",
          p.col(2).binaryExpr(row_norms(p.leftCols(2)), [](double z, double across) { return std::atan2(z, across); })},
         {"distance", row_norms(p)}}};
    for (const auto& [name, input] : inputs) {
      if (!neighbours_are_alike(local, input, random)) continue;
      return ResidualStructure{"instrument",
                               fmt::format("what is left is alike where the {} from the origin is alike", name)};
    }
  }
  for (std::size_t j = 0; j < fitted.robot.chain.joints.size(); ++j) {
    const Eigen::MatrixXd along = vectors.cwiseProduct(motions(fitted.robot, measurements, j)).rowwise().sum();
    for (Eigen::Index input = 0; input < measurements.poses.joints.cols(); ++input) {
      if (!neighbours_are_alike(along, measurements.poses.joints.col(input), random)) continue;
      return ResidualStructure{fitted.robot.chain.joints[j].name,
                               fmt::format("what is left along the motion of {} is alike where q{} is alike",
                                           fitted.robot.chain.joints[j].name, input + 1)};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<ResidualStructure> find_structure(const Calibration& fitted, const Measurements& measurements,
                                                const std::vector<std::size_t>& skipped, std::uint64_t seed) {
  const Measurements seen = without_rows(measurements, skipped);
  // Orientations are not tested, only points.
  const Measurements kept =
      once_each(orientation_rows(seen.poses).empty() ? seen : select(seen, position_rows(seen.poses)));
  if (kept.count() < fewest) return std::nullopt;
  const Residuals residuals = residuals_of(fitted, kept);
  if (!(residuals.vectors.squaredNorm() > 0.0)) return std::nullopt;
  Random random(seed);
  if (std::optional<ResidualStructure> fault = test_directions(residuals, fitted, kept, random)) return fault;
  return test_neighbours(residuals, fitted, kept, random);
}

double tail_weight(const Eigen::VectorXd& lengths, Eigen::Index components) {
  const double typical = median(lengths);
  const auto d = static_cast<double>(components);
  // Median of chi-squared with d degrees of freedom, Wilson and Hilferty.
  const double normal = 1.0 / std::sqrt(std::pow(1.0 - 2.0 / (9.0 * d), 3.0));
  return typical > 0.0 ? std::sqrt(lengths.squaredNorm() / static_cast<double>(lengths.size())) / typical / normal
                       : 0.0;
}

}  // namespace llmt::robotics
