#include "robot/planar_study.hpp"

#include <cmath>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/calibration_problem.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robot/shipped_robots.hpp"

namespace llmt::apps {
namespace {

using robotics::Poses;
using robotics::Robot;

// The planar arm's tool moves in x and y.
Eigen::MatrixXd plane_positions(const Robot& robot, const Poses& poses) {
  return robotics::positions(robot, poses).leftCols(2);
}

StudyRow study_row(const std::string& name, Eigen::Index poses, const std::vector<Eigen::Index>& leaves,
                   const Eigen::MatrixXd& model, const Eigen::MatrixXd& truth, std::optional<TotalError> paper) {
  const Eigen::VectorXd distances = (model - truth).rowwise().norm();
  return {name, poses, leaves, {distances.mean(), distances.maxCoeff()}, paper, distances};
}

// Grown to a given size without a test, from three samples a leaf on: the paper's trees.
FitOptions grown_to(Eigen::Index leaves) {
  FitOptions options;
  options.max_leaves = leaves;
  options.min_leaf_samples = 3;
  options.significance = every_split;
  options.validity = ValidityChoice::crisp;
  options.folds.count = 0;
  return options;
}

// The same trees with at most this number of leaves, smoothed: width, ridge and leaf count by cross-validation on the
// training poses.
FitOptions blended(Eigen::Index leaves, std::uint64_t seed) {
  FitOptions options = grown_to(leaves);
  options.validity = ValidityChoice::automatic;
  options.folds = {.count = 5, .seed = seed};
  return options;
}

// The same with products of the joints in the local models, six coefficients instead of three, so from six samples a
// leaf on.
FitOptions quadratic(FitOptions options) {
  options.terms = LocalTerms::quadratic;
  options.min_leaf_samples = 6;
  return options;
}

// The paper's smoothing: Gaussians of the given width over the leaves as they were grown.
FitOptions gaussian_as_grown(Eigen::Index leaves, double width) {
  FitOptions options = grown_to(leaves);
  options.validity = ValidityChoice::gaussian;
  options.expert.estimation = Estimation::as_grown;
  options.expert.widths = {width};
  return options;
}

// One tree per axis, each with its own options.
struct AxisTrees {
  std::vector<Model> models;
  std::vector<Eigen::Index> leaves;

  Eigen::MatrixXd predict(const Eigen::MatrixXd& joints) const {
    Eigen::MatrixXd result(joints.rows(), std::ssize(models));
    for (std::size_t axis = 0; axis < models.size(); ++axis) {
      result.col(axis) = models[axis].predict(joints);
    }
    return result;
  }
};

AxisTrees fit_axes(const Eigen::MatrixXd& joints, const Eigen::MatrixXd& outputs,
                   const std::vector<FitOptions>& options) {
  AxisTrees trees;
  for (std::size_t axis = 0; axis < options.size(); ++axis) {
    FitResult result = fit(joints, outputs.col(axis), options[axis]);
    trees.leaves.push_back(result.summary.partitions[0].leaves);
    trees.models.push_back(std::move(result.model));
  }
  return trees;
}

// The paper stops where further growth improves the accuracy by less than 2 %. Here: where the next ten splits lower
// the sum of squares by less than 2 % each, in their geometric mean (docs/paper.md).
Model stopped_at_two_percent(const Eigen::MatrixXd& joints, const Eigen::VectorXd& output) {
  constexpr Eigen::Index ahead = 10;
  const Model full = fit(joints, output, grown_to(0)).model;
  const auto squares = [&](Eigen::Index leaves) {
    return (full.prefix(leaves).predict(joints).col(0) - output).squaredNorm();
  };
  const double enough = std::pow(0.98, static_cast<double>(ahead));
  for (Eigen::Index leaves = 1; leaves + ahead <= full.partitions()[0].num_leaves(); ++leaves) {
    if (squares(leaves + ahead) > enough * squares(leaves)) return full.prefix(leaves);
  }
  return full;
}

AxisTrees stopped_axes(const Eigen::MatrixXd& joints, const Eigen::MatrixXd& outputs) {
  AxisTrees trees;
  for (Eigen::Index axis = 0; axis < outputs.cols(); ++axis) {
    trees.models.push_back(stopped_at_two_percent(joints, outputs.col(axis)));
    trees.leaves.push_back(trees.models.back().partitions()[0].num_leaves());
  }
  return trees;
}

// The calibrated arm, d = [L2, v2, L3, v3], eq. (12)-(15), by the undamped method of eq. (6)-(9).
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

// The arms, the grids of poses and the true positions on them.
struct PlanarData {
  Robot flexible;
  Robot rigid;
  Poses train;
  Poses test;
  Eigen::MatrixXd train_truth;
  Eigen::MatrixXd test_truth;
};

PlanarData planar_data(bool carry_over) {
  PlanarData data;
  data.flexible = robotics::parse_robot(planar_two_link_yaml, "planar_two_link.yaml");
  for (robotics::Effect& effect : data.flexible.effects) {
    effect.type = carry_over ? "link_bending" : "link_bending_no_carry_over";
  }
  data.rigid = data.flexible;
  data.rigid.effects.clear();
  data.train = robotics::grid(data.flexible.chain, 0.1);
  data.test = robotics::grid(data.flexible.chain, 0.05);
  data.train_truth = plane_positions(data.flexible, data.train);
  data.test_truth = plane_positions(data.flexible, data.test);
  return data;
}

// What the calibrated arm leaves, and its predictions where it is tested.
struct CalibratedPlane {
  Eigen::MatrixXd residual;  // eq. (16), (17)
  Eigen::MatrixXd test;
};

// Rows of the arm: rigid, calibrated, and corrected by every kind of tree.
void study_arm(const PlanarData& data, const CalibratedPlane& calibrated, std::uint64_t seed, PlanarStudy& study) {
  const Eigen::Index poses = data.train.count();
  study.arm.push_back(
      study_row("rigid", 0, {}, plane_positions(data.rigid, data.test), data.test_truth, TotalError{0.643, 1.427}));
  study.arm.push_back(study_row("calibrated", poses, {}, calibrated.test, data.test_truth, TotalError{0.447, 0.716}));
  const auto correct_by = [&](const std::string& name, const AxisTrees& trees,
                              std::optional<TotalError> paper = std::nullopt) {
    Eigen::MatrixXd correction = trees.predict(data.test.joints);
    const Eigen::MatrixXd corrected = calibrated.test + correction;  // eq. (18), (19)
    study.arm.push_back(study_row(name, poses, trees.leaves, corrected, data.test_truth, paper));
    return correction;
  };
  const auto correct = [&](const std::string& name, const std::vector<FitOptions>& options,
                           std::optional<TotalError> paper = std::nullopt) {
    return correct_by(name, fit_axes(data.train.joints, calibrated.residual, options), paper);
  };
  study.figures.correction =
      correct("corrected, the paper's leaf counts", {grown_to(93), grown_to(75)}, TotalError{0.0157, 0.131});
  correct_by("corrected, stopped at 2 %", stopped_axes(data.train.joints, calibrated.residual));
  FitOptions cross_validated = grown_to(0);
  cross_validated.folds = {.count = 5, .seed = seed};
  correct("corrected, leaves by 5-fold CV", {cross_validated, cross_validated});
  correct("Gaussians, narrow, as grown", {gaussian_as_grown(93, 1.0 / 3.0), gaussian_as_grown(75, 1.0 / 3.0)});
  correct("Gaussians, wide, as grown", {gaussian_as_grown(93, 0.7), gaussian_as_grown(75, 0.7)});
  correct("blend, the paper's leaf counts", {blended(93, seed), blended(75, seed)});
  correct("blend, a third of the leaves", {blended(25, seed), blended(25, seed)});
  correct("quadratic, half the leaves", {quadratic(grown_to(46)), quadratic(grown_to(37))});
  correct("blend, quadratic, half the leaves", {quadratic(blended(46, seed)), quadratic(blended(37, seed))});
  correct("blend, quadratic, 25 leaves", {quadratic(blended(25, seed)), quadratic(blended(25, seed))});
}

// Crisp and blended trees of the residual in x with noise.
void study_noise(const PlanarData& data, const CalibratedPlane& calibrated, std::uint64_t seed, PlanarStudy& study) {
  Random random(seed);
  Eigen::VectorXd noisy = calibrated.residual.col(0);
  for (double& value : noisy) {
    value += noise_mm * random.normal();
  }
  const Eigen::VectorXd truth = (data.test_truth - calibrated.test).col(0);
  const auto noisy_error = [&](FitOptions options) {
    options.min_leaf_samples = 0;
    return rmse(fit(data.train.joints, noisy, options).model.predict(data.test.joints), truth)(0);
  };
  FitOptions crisp = blended(93, seed);
  crisp.validity = ValidityChoice::crisp;
  study.noisy_crisp = noisy_error(crisp);
  study.noisy_blend = noisy_error(blended(93, seed));
}

// Trees of the positions themselves, without a model of the arm.
void study_black_box(const PlanarData& data, bool large, std::uint64_t seed, PlanarStudy& study) {
  const auto add = [&](const std::string& name, const Poses& poses, const Eigen::MatrixXd& positions,
                       const std::vector<FitOptions>& options, std::optional<TotalError> paper) {
    const AxisTrees trees = fit_axes(poses.joints, positions, options);
    Eigen::MatrixXd predicted = trees.predict(data.test.joints);
    study.black_box.push_back(study_row(name, poses.count(), trees.leaves, predicted, data.test_truth, paper));
    return predicted;
  };
  study.figures.black_box =
      add("black box", data.train, data.train_truth, {grown_to(211), grown_to(209)}, TotalError{7.877, 42.815});
  add("black box, blend", data.train, data.train_truth, {blended(211, seed), blended(209, seed)}, std::nullopt);
  if (!large) return;
  const Poses fine = robotics::grid(data.flexible.chain, 0.01);
  add("black box", fine, plane_positions(data.flexible, fine), {grown_to(3283), grown_to(3331)},
      TotalError{0.406, 3.299});
}

}  // namespace

PlanarStudy planar_study(bool carry_over, bool large, std::uint64_t seed) {
  const PlanarData data = planar_data(carry_over);
  PlanarStudy study;
  study.carry_over = carry_over;
  study.calibration = calibrate_plane(data.rigid, data.train, data.train_truth);
  const Robot robot = robotics::with_values(data.rigid, study.calibration.values);
  const CalibratedPlane calibrated{data.train_truth - plane_positions(robot, data.train),
                                   plane_positions(robot, data.test)};
  study.figures.joints = data.test.joints;
  study.figures.error = data.test_truth - calibrated.test;
  study_arm(data, calibrated, seed, study);
  study_noise(data, calibrated, seed, study);
  study_black_box(data, large, seed, study);
  return study;
}

}  // namespace llmt::apps
