#include "robot/planar_study.hpp"

#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robot/shipped_robots.hpp"

namespace llmt::apps {
namespace {

using robotics::Poses;
using robotics::Robot;

/// The planar arm's tool moves in x and y.
Eigen::MatrixXd plane_positions(const Robot& robot, const Poses& poses) {
  return robotics::positions(robot, poses).leftCols(2);
}

TotalError total_error(const Eigen::MatrixXd& model, const Eigen::MatrixXd& truth) {
  const Eigen::VectorXd distances = (model - truth).rowwise().norm();
  return {distances.mean(), distances.maxCoeff()};
}

/// Grown to a given size without a test, from three samples a leaf on: the paper's trees.
FitOptions grown_to(std::ptrdiff_t leaves) {
  FitOptions options;
  options.max_leaves = leaves;
  options.min_leaf_samples = 3;
  options.significance = 1.0;
  options.expert.min_variance_gain = -1.0;
  options.validity = ValidityChoice::crisp;
  options.folds.count = 0;
  return options;
}

/// The same trees with at most as many leaves, smoothed: width, ridge and leaf count by cross-validation on the
/// training poses.
FitOptions blended(std::ptrdiff_t leaves, std::uint64_t seed) {
  FitOptions options = grown_to(leaves);
  options.validity = ValidityChoice::automatic;
  options.folds = {.count = 5, .seed = seed};
  return options;
}

/// The same with products of the joints in the local models, six coefficients instead of three, so from six samples a
/// leaf on.
FitOptions quadratic(FitOptions options) {
  options.terms = LocalTerms::quadratic;
  options.min_leaf_samples = 6;
  return options;
}

/// The paper's smoothing: Gaussians of the given width over the leaves as they were grown.
FitOptions gaussian_as_grown(std::ptrdiff_t leaves, double width) {
  FitOptions options = grown_to(leaves);
  options.validity = ValidityChoice::gaussian;
  options.expert.estimation = Estimation::as_grown;
  options.expert.widths = {width};
  return options;
}

/// One tree per axis, each with its own options.
struct AxisTrees {
  std::vector<Model> models;
  std::vector<std::ptrdiff_t> leaves;

  Eigen::MatrixXd predict(const Eigen::MatrixXd& joints) const {
    Eigen::MatrixXd result(joints.rows(), std::ssize(models));
    for (std::size_t axis = 0; axis < models.size(); ++axis) {
      result.col(static_cast<Eigen::Index>(axis)) = models[axis].predict(joints);
    }
    return result;
  }
};

AxisTrees fit_axes(const Eigen::MatrixXd& joints, const Eigen::MatrixXd& outputs,
                   const std::vector<FitOptions>& options) {
  AxisTrees trees;
  for (std::size_t axis = 0; axis < options.size(); ++axis) {
    FitResult result = fit(joints, outputs.col(static_cast<Eigen::Index>(axis)), options[axis]);
    trees.leaves.push_back(result.summary.partitions[0].leaves);
    trees.models.push_back(std::move(result.model));
  }
  return trees;
}

/// The calibrated arm, d = [L2, v2, L3, v3], eq. (12)-(15), by the undamped method of eq. (6)-(9).
discovery::SolverResult calibrate_plane(const Robot& rigid, const Poses& poses, const Eigen::MatrixXd& truth) {
  robotics::Measurements measurements;
  measurements.poses = poses;
  measurements.positions_mm = Eigen::MatrixXd::Zero(truth.rows(), 3);
  measurements.positions_mm.leftCols(2) = truth;
  measurements.measured = {true, true, false};
  discovery::LeastSquaresProblem problem = robotics::calibration_problem(rigid, measurements);
  for (discovery::Parameter& parameter : problem.parameters) {
    parameter.free = parameter.name == "joint2.a" || parameter.name == "joint2.b" || parameter.name == "tool.x" ||
                     parameter.name == "tool.y";
  }
  return discovery::solve(problem, {.damping = 0.0});
}

}  // namespace

PlanarStudy planar_study(bool carry_over, bool large, std::uint64_t seed) {
  Robot flexible = robotics::parse_robot(planar_two_link_yaml, "planar_two_link.yaml");
  for (robotics::Effect& effect : flexible.effects) {
    effect.type = carry_over ? "link_bending" : "link_bending_no_carry_over";
  }
  Robot rigid = flexible;
  rigid.effects.clear();

  const Poses train = robotics::grid(flexible.chain, 0.1);
  const Poses test = robotics::grid(flexible.chain, 0.05);
  const Eigen::MatrixXd train_truth = plane_positions(flexible, train);
  const Eigen::MatrixXd test_truth = plane_positions(flexible, test);

  PlanarStudy study;
  study.carry_over = carry_over;
  study.calibration = calibrate_plane(rigid, train, train_truth);
  const Robot calibrated = robotics::with_values(rigid, study.calibration.values);
  const Eigen::MatrixXd calibrated_test = plane_positions(calibrated, test);
  const Eigen::MatrixXd residual = train_truth - plane_positions(calibrated, train);  // eq. (16), (17)

  study.arm.push_back(
      {"rigid", 0, {}, total_error(plane_positions(rigid, test), test_truth), TotalError{0.643, 1.427}});
  study.arm.push_back(
      {"calibrated", train.count(), {}, total_error(calibrated_test, test_truth), TotalError{0.447, 0.716}});
  const auto correct = [&](const std::string& name, const std::vector<FitOptions>& options,
                           std::optional<TotalError> paper) {
    const AxisTrees trees = fit_axes(train.joints, residual, options);
    const Eigen::MatrixXd corrected = calibrated_test + trees.predict(test.joints);  // eq. (18), (19)
    study.arm.push_back({name, train.count(), trees.leaves, total_error(corrected, test_truth), paper});
  };
  correct("corrected, the paper's leaf counts", {grown_to(93), grown_to(75)}, TotalError{0.0157, 0.131});
  FitOptions until_two_percent = grown_to(0);
  until_two_percent.expert.min_improvement = 0.02;
  correct("corrected, stopped at 2 %", {until_two_percent, until_two_percent}, std::nullopt);
  FitOptions cross_validated = grown_to(0);
  cross_validated.folds = {.count = 5, .seed = seed};
  correct("corrected, leaves by 5-fold CV", {cross_validated, cross_validated}, std::nullopt);
  correct("Gaussians, narrow, as grown", {gaussian_as_grown(93, 1.0 / 3.0), gaussian_as_grown(75, 1.0 / 3.0)},
          std::nullopt);
  correct("Gaussians, wide, as grown", {gaussian_as_grown(93, 0.7), gaussian_as_grown(75, 0.7)}, std::nullopt);
  correct("blend, the paper's leaf counts", {blended(93, seed), blended(75, seed)}, std::nullopt);
  correct("blend, a third of the leaves", {blended(25, seed), blended(25, seed)}, std::nullopt);
  correct("quadratic, half the leaves", {quadratic(grown_to(46)), quadratic(grown_to(37))}, std::nullopt);
  correct("blend, quadratic, half the leaves", {quadratic(blended(46, seed)), quadratic(blended(37, seed))},
          std::nullopt);
  correct("blend, quadratic, 25 leaves", {quadratic(blended(25, seed)), quadratic(blended(25, seed))}, std::nullopt);

  Random random(seed);
  Eigen::VectorXd noisy = residual.col(0);
  for (double& value : noisy) {
    value += noise_mm * random.normal();
  }
  const Eigen::VectorXd truth = (test_truth - calibrated_test).col(0);
  const auto noisy_error = [&](FitOptions options) {
    options.min_leaf_samples = 0;
    return rmse(fit(train.joints, noisy, options).model.predict(test.joints), truth)(0);
  };
  FitOptions crisp = blended(93, seed);
  crisp.validity = ValidityChoice::crisp;
  study.noisy_crisp = noisy_error(crisp);
  study.noisy_blend = noisy_error(blended(93, seed));

  const auto black_box = [&](const std::string& name, const Poses& poses, const Eigen::MatrixXd& positions,
                             std::ptrdiff_t x_leaves, std::ptrdiff_t y_leaves, TotalError paper) {
    const AxisTrees trees = fit_axes(poses.joints, positions, {grown_to(x_leaves), grown_to(y_leaves)});
    study.black_box.push_back(
        {name, poses.count(), trees.leaves, total_error(trees.predict(test.joints), test_truth), paper});
  };
  black_box("black box", train, train_truth, 211, 209, {7.877, 42.815});
  const AxisTrees smooth = fit_axes(train.joints, train_truth, {blended(211, seed), blended(209, seed)});
  study.black_box.push_back({"black box, blend", train.count(), smooth.leaves,
                             total_error(smooth.predict(test.joints), test_truth), std::nullopt});
  if (large) {
    const Poses fine = robotics::grid(flexible.chain, 0.01);
    black_box("black box", fine, plane_positions(flexible, fine), 3283, 3331, {0.406, 3.299});
  }
  return study;
}

}  // namespace llmt::apps
