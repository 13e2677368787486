// The same least squares in Ceres Solver, with differences of its own: the same minimum and the same covariance.
#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <cmath>

#include "llmt/robotics/calibration.hpp"
#include "robotics/effects.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

// The values of the free parameters, counted in their scales from where the fit starts; 1 at the start, so that Ceres'
// steps, which are relative to the value, suit them all.
struct Deviations {
  const Robot& start;
  const Measurements& measurements;
  const std::vector<discovery::Parameter>& parameters;
  const std::vector<Eigen::Index>& free;

  Eigen::VectorXd values(const double* counted) const {
    Eigen::VectorXd all(std::ssize(parameters));
    for (std::size_t k = 0; k < parameters.size(); ++k) all(k) = parameters[k].value;
    for (std::size_t k = 0; k < free.size(); ++k) all(free[k]) += (counted[k] - 1.0) * parameters[free[k]].scale;
    return all;
  }

  bool operator()(double const* const* counted, double* residuals) const {
    const Eigen::MatrixXd points = positions(with_values(start, values(counted[0])), measurements.poses);
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        *residuals++ = points(i, axis) - measurements.positions_mm(i, axis);
      }
    }
    return true;
  }
};

struct Agreement {
  double minimum = 0.0;     // largest difference of a parameter, in standard errors
  double covariance = 0.0;  // largest difference of an entry, over the two standard errors
};

// Without priors, so that both see nothing but the data. Which parameters are free is the calibration's choice.
Agreement compare(const Robot& truth, const Robot& described, std::uint64_t seed) {
  const Measurements seen = measure(truth, random_poses(truth.chain, 120, seed), 0.05, seed + 1);
  CalibrationOptions options;
  options.prior_length_mm = 0.0;
  options.prior_angle_deg = 0.0;
  const Calibration ours = calibrate(described, seen, options);
  EXPECT_TRUE(ours.result.converged()) << ours.result.reason;

  const std::vector<discovery::Parameter> start = parameters(ours.registered);
  std::vector<Eigen::Index> free;
  for (std::size_t k = 0; k < start.size(); ++k) {
    if (ours.robot.identified.at(k).standard_error) free.push_back(static_cast<Eigen::Index>(k));
  }
  const Deviations deviations{ours.registered, seen, start, free};
  auto* cost = new ceres::DynamicNumericDiffCostFunction<Deviations, ceres::RIDDERS>(new Deviations(deviations));
  cost->AddParameterBlock(static_cast<int>(free.size()));
  cost->SetNumResiduals(static_cast<int>(3 * seen.count()));
  std::vector<double> counted(free.size(), 1.0);
  ceres::Problem problem;
  problem.AddResidualBlock(cost, nullptr, counted.data());
  ceres::Solver::Options strict;
  strict.linear_solver_type = ceres::DENSE_QR;
  strict.function_tolerance = 0.0;
  strict.gradient_tolerance = 1e-12;
  strict.parameter_tolerance = 1e-12;
  strict.max_num_iterations = 200;
  ceres::Solver::Summary summary;
  ceres::Solve(strict, &problem, &summary);

  ceres::Covariance::Options dense;
  dense.algorithm_type = ceres::DENSE_SVD;
  ceres::Covariance covariance(dense);
  std::vector<std::pair<const double*, const double*>> blocks = {{counted.data(), counted.data()}};
  EXPECT_TRUE(covariance.Compute(blocks, &problem));
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Matrix theirs(free.size(), free.size());
  EXPECT_TRUE(covariance.GetCovarianceBlock(counted.data(), counted.data(), theirs.data()));
  theirs *= 2.0 * summary.final_cost / static_cast<double>(3 * seen.count() - std::ssize(free));

  Agreement worst;
  const Eigen::VectorXd values = deviations.values(counted.data());
  const Eigen::VectorXd& errors = ours.result.standard_errors;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const Eigen::Index k = free[i];
    worst.minimum = std::max(worst.minimum, std::abs(values(k) - ours.result.values(k)) / errors(k));
    for (std::size_t j = 0; j < free.size(); ++j) {
      const double theirs_here = theirs(i, j) * start[k].scale * start[free[j]].scale;
      const double difference = std::abs(theirs_here - ours.result.covariance(k, free[j]));
      worst.covariance = std::max(worst.covariance, difference / (errors(k) * errors(free[j])));
    }
  }
  return worst;
}

TEST(CalibrationInCeres, RigidArmsHaveTheSameMinimumAndCovariance) {
  for (const Robot& nominal : {ur_like(), mdh_like(), seven_axes(), scara()}) {
    const Agreement worst = compare(perturbed(nominal, 1.0, 0.3, 5), nominal, 6);
    EXPECT_LT(worst.minimum, 1e-4) << nominal.chain.joints.size();
    EXPECT_LT(worst.covariance, 1e-4) << nominal.chain.joints.size();
  }
}

TEST(CalibrationInCeres, AnArmThatBendsHasTheSameMinimumAndCovariance) {
  Robot described = weighted(ur_like());
  described.effects = {{"joint_compliance", "joint2", {0.0}}, {"joint_compliance", "joint3", {0.0}}};
  Robot truth = perturbed(described, 1.0, 0.3, 7);
  for (Effect& effect : truth.effects) effect.values = {2e-5};
  const Agreement worst = compare(truth, described, 8);
  EXPECT_LT(worst.minimum, 1e-4) << worst.minimum;
  EXPECT_LT(worst.covariance, 1e-4);
}

}  // namespace
}  // namespace llmt::robotics
