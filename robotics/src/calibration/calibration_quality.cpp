#include "llmt/robotics/calibration_quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>

#include "calibration/joint_ranges.hpp"
#include "calibration/noise_model.hpp"
#include "calibration/singular_values.hpp"
#include "linear_algebra/linear_algebra.hpp"
#include "llmt/random.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {
namespace {

// The Jacobian of the free parameters at the calibrated values, rows over their standard deviations, columns in
// parameter scales.
struct Weighed {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residuals;  // measured - model over the same standard deviations
  Eigen::VectorXd weights;
  Eigen::VectorXd prior;  // 1 / sigma^2 of each column, in scales; 0: none
};

Weighed weighed(const Calibration& calibration, const Measurements& measurements) {
  std::vector<Eigen::Index> free;
  const std::vector<discovery::Parameter>& parameters = calibration.result.parameters;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].free) free.push_back(static_cast<Eigen::Index>(k));
  }
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  Weighed result;
  const double lever = orientation_rows(measurements.poses).empty()
                           ? 1.0
                           : measurements.poses.observations[orientation_rows(measurements.poses).front()].lever_mm;
  result.weights =
      NoiseModel(measurements, {}).weights({calibration.noise_mm, 1e-3 * calibration.orientation_noise_mrad * lever});
  result.jacobian = rows_of(position_jacobian(calibration.robot, measurements.poses, free), rows);
  const Eigen::MatrixXd errors =
      (measurements.positions_mm - positions(calibration.robot, measurements.poses)).transpose();
  result.residuals = errors.reshaped()(rows).cwiseProduct(result.weights);
  scale_rows(result.jacobian, result.weights);
  result.prior = Eigen::VectorXd::Zero(std::ssize(free));
  for (Eigen::Index c = 0; c < std::ssize(free); ++c) {
    const discovery::Parameter& parameter = parameters[free[c]];
    result.jacobian.col(c) *= parameter.scale;
    if (parameter.prior_sigma) result.prior(c) = std::pow(parameter.scale / *parameter.prior_sigma, 2);
  }
  return result;
}

double mean_error(const Robot& robot, const Measurements& measurements) {
  const Eigen::VectorXd errors = distances(positions(robot, measurements.poses), measurements);
  return errors(position_rows(measurements.poses)).mean();
}

// Rows of each pose.
std::vector<std::vector<Eigen::Index>> poses_of(const Measurements& measurements) {
  const std::vector<double> labels = pose_labels(measurements.poses);
  std::map<double, std::vector<Eigen::Index>> groups;
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    groups[labels.empty() ? static_cast<double>(i) : labels[i]].push_back(i);
  }
  std::vector<std::vector<Eigen::Index>> poses;
  for (auto& [label, rows] : groups) poses.push_back(std::move(rows));
  return poses;
}

Measurements of_poses(const Measurements& measurements, const std::vector<std::vector<Eigen::Index>>& poses,
                      std::span<const Eigen::Index> chosen) {
  std::vector<Eigen::Index> rows;
  for (const Eigen::Index pose : chosen) rows.insert(rows.end(), poses[pose].begin(), poses[pose].end());
  std::ranges::sort(rows);
  return select(measurements, rows);
}

double root_mean_square_of(const Eigen::VectorXd& values) {
  return values.size() == 0 ? 0.0 : values.norm() / std::sqrt(static_cast<double>(values.size()));
}

}  // namespace

Eigen::VectorXd leave_one_out(const Calibration& calibration, const Measurements& measurements) {
  const Weighed fit = weighed(calibration, measurements);
  Eigen::MatrixXd information = gram(fit.jacobian);
  information.diagonal() += fit.prior;
  // A direction that nothing determines moves no reading either.
  information.diagonal().array() += 1e-12 * information.diagonal().maxCoeff();
  const Eigen::MatrixXd whitened = Cholesky(information).whitened(fit.jacobian);
  const std::vector<Eigen::Index> coordinates = measured_rows(measurements);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(measurements.count());
  std::map<Eigen::Index, std::vector<Eigen::Index>> of_row;
  for (Eigen::Index k = 0; k < std::ssize(coordinates); ++k) of_row[coordinates[k] / 3].push_back(k);
  for (const std::vector<Eigen::Index>& rows : poses_of(measurements)) {
    std::vector<Eigen::Index> own;
    for (const Eigen::Index row : rows) own.insert(own.end(), of_row[row].begin(), of_row[row].end());
    Eigen::MatrixXd left = identity_minus_gram(columns_of(whitened, own));
    left.diagonal().array() += 1e-9;
    const Eigen::VectorXd errors = solve_symmetric(left, entries_of(fit.residuals, own));
    for (std::size_t k = 0; k < own.size(); ++k) {
      squares(coordinates[own[k]] / 3) += std::pow(errors(k) / fit.weights(own[k]), 2);
    }
  }
  return squares.cwiseSqrt();
}

Observability observability_of(const Calibration& calibration, const Measurements& measurements) {
  const Weighed fit = weighed(calibration, measurements);
  return observability(singular_values(fit.jacobian), std::ssize(poses_of(measurements)));
}

std::optional<RepeatNoise> noise_of_repeats(const Measurements& measurements) {
  const auto pose = measurements.poses.covariates.find("pose");
  if (pose == measurements.poses.covariates.end()) return std::nullopt;
  std::map<std::tuple<double, std::string, std::string>, std::vector<Eigen::Index>> groups;
  for (const Eigen::Index i : position_rows(measurements.poses)) {
    const Observation seen =
        measurements.poses.observations.empty() ? Observation{} : measurements.poses.observations[i];
    groups[{pose->second(i), seen.base, seen.tool}].push_back(i);
  }
  double squares = 0.0;
  RepeatNoise noise;
  for (const auto& [key, rows] : groups) {
    const Eigen::MatrixXd own = measurements.positions_mm(rows, Eigen::all);
    squares += (own.rowwise() - own.colwise().mean()).squaredNorm();
    noise.freedom += std::ssize(rows) - 1;
  }
  if (noise.freedom == 0) return std::nullopt;
  const auto coordinates = static_cast<double>(std::ranges::count(measurements.measured, true));
  noise.sigma_mm = std::sqrt(squares / (coordinates * static_cast<double>(noise.freedom)));
  return noise;
}

Eigen::VectorXd position_deviations(const Calibration& calibration, const Poses& poses, bool frames_are_known) {
  // Joint maps come last among the robot's parameters, and calibration has no covariance of them.
  Eigen::MatrixXd jacobian = position_jacobian(calibration.robot, poses).leftCols(calibration.result.covariance.cols());
  for (Eigen::Index k = 0; k < jacobian.cols() && frames_are_known; ++k) {
    if (is_frame_parameter(calibration.result.parameters[k].name)) jacobian.col(k).setZero();
  }
  const Eigen::MatrixXd covariance =
      calibration.result.covariance.unaryExpr([](double value) { return std::isfinite(value) ? value : 0.0; });
  const Eigen::VectorXd variances = quadratic_forms(jacobian, covariance);
  Eigen::VectorXd deviations(poses.count());
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    deviations(i) = std::sqrt(std::max(0.0, variances.segment(3 * i, 3).sum()));
  }
  return deviations;
}

std::vector<Beyond> beyond_calibrated(const Chain& chain, const CalibrationRecord& record, const Poses& used) {
  const std::vector<std::array<double, 2>>& ranges = record.joint_ranges;
  if (!ranges.empty() && ranges.size() != chain.joints.size()) {
    throw std::invalid_argument(fmt::format("llmt::robotics::beyond_calibrated: there are {} ranges of {} joints",
                                            ranges.size(), chain.joints.size()));
  }
  std::vector<Beyond> beyond;
  if (used.count() == 0) return beyond;
  const auto add = [&](const std::string& name, const std::string& unit, const std::array<double, 2>& range,
                       double least_margin, const Eigen::VectorXd& values) {
    constexpr double slack = 0.1;  // of the range
    const double margin = std::max(slack * (range[1] - range[0]), least_margin);
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      if (values(i) < range[0] - margin || values(i) > range[1] + margin) rows.push_back(i);
    }
    if (rows.empty()) return;
    beyond.push_back({name, unit, range[0], range[1], values.minCoeff(), values.maxCoeff(), std::move(rows)});
  };
  for (std::size_t j = 0; j < ranges.size(); ++j) {
    const Joint& joint = chain.joints[j];
    // A joint that stood still is beyond its range where it would no longer be one that stood still.
    add(joint.name, limit_unit(joint), ranges[j], still_range(joint), used.joints.col(j) * to_limit_unit(joint));
  }
  constexpr double least = 0.5;  // kg, K
  const auto values_of = [&](const std::string& column) -> Eigen::VectorXd {
    const auto stated = used.covariates.find(column);
    return stated == used.covariates.end() ? Eigen::VectorXd() : stated->second;
  };
  for (const auto& [column, range] : record.condition_ranges) {
    const bool is_payload = column == "payload_kg";
    Eigen::VectorXd values = values_of(column);
    if (is_payload && values.size() == 0) values = Eigen::VectorXd::Constant(used.count(), chain.payload.mass_kg);
    if (values.size() > 0) add(is_payload ? "payload" : "temperature", is_payload ? "kg" : "C", range, least, values);
  }
  return beyond;
}

std::vector<Eigen::Index> rows_beyond(const std::vector<Beyond>& beyond) {
  std::set<Eigen::Index> rows;
  for (const Beyond& own : beyond) rows.insert(own.rows.begin(), own.rows.end());
  return {rows.begin(), rows.end()};
}

std::string to_string(const Beyond& beyond) {
  return fmt::format("{} from {:.4g} to {:.4g} {}, calibrated from {:.4g} to {:.4g}", beyond.name, beyond.used_low,
                     beyond.used_high, beyond.unit, beyond.measured_low, beyond.measured_high);
}

Coverage coverage(const Calibration& calibration, const Poses& measured, const Poses& used, bool frames_are_known) {
  Coverage result;
  if (used.count() == 0) return result;
  const Chain& chain = calibration.robot.chain;
  CalibrationRecord seen;
  seen.joint_ranges = joint_ranges_of(chain, measured);
  seen.condition_ranges = condition_ranges_of(chain, measured);
  result.beyond = beyond_calibrated(chain, seen, used);
  result.outside = rows_beyond(result.beyond);
  std::vector<Eigen::Index> inside;
  for (Eigen::Index i = 0; i < used.count(); ++i) {
    if (!std::ranges::binary_search(result.outside, i)) inside.push_back(i);
  }
  const Eigen::VectorXd deviations = position_deviations(calibration, used, frames_are_known);
  result.deviation_inside_mm = root_mean_square_of(deviations(inside));
  result.deviation_outside_mm = root_mean_square_of(deviations(result.outside));
  return result;
}

std::vector<LearningPoint> learning_curve(const Robot& robot, const Measurements& measurements,
                                          const CalibrationOptions& options, int draws, std::uint64_t seed) {
  constexpr Eigen::Index fewest = 30;
  constexpr Eigen::Index first = 12;
  constexpr Eigen::Index enough = 2000;
  constexpr int points = 8;
  const std::vector<std::vector<Eigen::Index>> poses = poses_of(measurements);
  const auto count = std::ssize(poses);
  if (count < fewest) return {};
  // Few poses may miss a session, or hardly tell its frames: then those are fitted to all poses, and the arm is judged.
  const bool several_sessions = !with_frames(robot, measurements.poses).chain.bases.empty();
  Random random(seed);
  std::vector<Eigen::Index> order = random.permutation(count);
  const Eigen::Index aside = count / 5;
  const Measurements test = of_poses(measurements, poses, std::span(order).first(aside));
  std::vector<Eigen::Index> rest(order.begin() + aside, order.end());
  const double most = static_cast<double>(std::min(std::ssize(rest), enough));
  std::vector<LearningPoint> curve;
  for (int k = 0; k < points; ++k) {
    const auto size = std::lround(first * std::pow(most / first, k / (points - 1.0)));
    if (!curve.empty() && curve.back().poses == size) continue;
    Eigen::VectorXd fitted(draws);
    Eigen::VectorXd held_out(draws);
    for (int draw = 0; draw < draws; ++draw) {
      const std::vector<Eigen::Index> places = random.permutation(std::ssize(rest));
      std::vector<Eigen::Index> chosen;
      for (Eigen::Index i = 0; i < size; ++i) chosen.push_back(rest[places[i]]);
      const Measurements train = of_poses(measurements, poses, chosen);
      const Robot calibrated = calibrate(robot, train, options).robot;
      fitted(draw) = mean_error(calibrated, train);
      held_out(draw) = mean_error(several_sessions ? with_placed_frames(calibrated, measurements, {})
                                                   : with_placed_frames(calibrated, test, train.poses),
                                  test);
    }
    curve.push_back({size, median(fitted), median(held_out)});
  }
  return curve;
}

}  // namespace llmt::robotics
