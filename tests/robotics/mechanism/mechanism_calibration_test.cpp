// Calibration of mechanisms: closed forms, the paper's arm, recovered parameters.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "llmt/discovery/least_squares.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/calibration_problem.hpp"
#include "llmt/robotics/mechanism/mechanism_calibration.hpp"
#include "llmt/robotics/mechanism/mechanism_file.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/robots.hpp"
#include "study.hpp"

namespace llmt::robotics {
namespace {

Mechanism sample(const std::string& name) { return read_mechanism(LLMT_ROBOTS_DIR "/../../docs/samples/" + name); }

Eigen::Index index_of(const Mechanism& mechanism, const std::string& name) {
  const auto& all = mechanism.coordinates;
  return std::ranges::find(all, name, &Coordinate::name) - all.begin();
}

// Parameters off by normal numbers of that size in mm and deg.
Mechanism off_by(Mechanism mechanism, double mm, double deg, Random& random) {
  for (MechanismParameter& parameter : mechanism.parameters) {
    if (!parameter.fixed) parameter.value += (parameter.unit == "mm" ? mm : deg) * random.normal();
  }
  return mechanism;
}

// Random poses within the limits of the drives, all coordinates.
Eigen::MatrixXd poses_of(const Mechanism& mechanism, Eigen::Index count, Random& random) {
  Eigen::MatrixXd known = Eigen::MatrixXd::Constant(count, std::ssize(mechanism.coordinates), NAN);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index c = 0; c < known.cols(); ++c) {
      const Coordinate& coordinate = mechanism.coordinates[c];
      if (coordinate.has_limits()) known(i, c) = random.uniform(coordinate.lower, coordinate.upper);
    }
  }
  const Assembly assembly = assemble(mechanism, known);
  std::vector<Eigen::Index> taken;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (assembly.failures[i].empty()) taken.push_back(i);
  }
  return assembly.coordinates(taken, Eigen::all);
}

// The named coordinates with normal noise, the rest not measured.
Eigen::MatrixXd readings(const Mechanism& mechanism, const Eigen::MatrixXd& poses,
                         const std::vector<std::pair<std::string, double>>& sensors, Random& random) {
  Eigen::MatrixXd measured = Eigen::MatrixXd::Constant(poses.rows(), poses.cols(), NAN);
  for (const auto& [name, sigma] : sensors) {
    const Eigen::Index c = index_of(mechanism, name);
    for (Eigen::Index i = 0; i < poses.rows(); ++i) measured(i, c) = poses(i, c) + sigma * random.normal();
  }
  return measured;
}

// Errors in both variables: the orthogonal line has a closed form (Deming 1943), the slope of the first principal axis.
TEST(MechanismCalibration, LineWithErrorsInBothVariablesIsDemingsLine) {
  Random random(1);
  Eigen::MatrixXd points(40, 2);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const double x = 0.25 * static_cast<double>(i);
    points.row(i) << x + 0.5 * random.normal(), 2.0 + 0.7 * x + 0.5 * random.normal();
  }
  const Mechanism line{
      .name = "line",
      .parameters = {{.name = "a", .unit = "1"}, {.name = "b", .unit = "1", .value = 1.0}},
      .coordinates = {{.name = "x", .unit = "1", .sigma = 1.0}, {.name = "y", .unit = "1", .sigma = 1.0}},
      .definitions = {},
      .equations = {"y = a + b*x"}};
  const MechanismCalibration found = calibrate(line, points);
  const Eigen::RowVector2d mean = points.colwise().mean();
  const Eigen::MatrixXd centred = points.rowwise() - mean;
  const Eigen::Matrix2d s = centred.transpose() * centred;
  const double gap = s(1, 1) - s(0, 0);
  const double slope = (gap + std::sqrt(gap * gap + 4.0 * s(0, 1) * s(0, 1))) / (2.0 * s(0, 1));
  EXPECT_TRUE(found.result.converged()) << found.result.reason;
  EXPECT_NEAR(found.mechanism.parameters[1].value, slope, 1e-8);
  EXPECT_NEAR(found.mechanism.parameters[0].value, mean(1) - slope * mean(0), 1e-7);
  const double distances = (centred.col(1) - slope * centred.col(0)).squaredNorm() / (1.0 + slope * slope);
  EXPECT_NEAR(found.result.residuals.squaredNorm(), distances, 1e-9 * distances);
  EXPECT_NEAR(found.corrections.squaredNorm(), distances, 1e-9 * distances);
  EXPECT_EQ(found.result.dof, 38);
}

// The circle nearest to points, by the geometric distance, against a fine search.
TEST(MechanismCalibration, CircleHasTheLeastGeometricDistances) {
  Random random(2);
  Eigen::MatrixXd points(30, 2);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const double angle = random.uniform(0.0, 2.0);
    points.row(i) << 10.0 + 5.0 * std::cos(angle) + 0.2 * random.normal(),
        3.0 + 5.0 * std::sin(angle) + 0.2 * random.normal();
  }
  const Mechanism circle{
      .name = "circle",
      .parameters = {{.name = "u", .value = 9.0}, {.name = "v", .value = 2.0}, {.name = "r", .value = 6.0}},
      .coordinates = {{.name = "x", .unit = "mm", .start = 14, .sigma = 1.0},
                      {.name = "y", .unit = "mm", .start = 3, .sigma = 1.0}},
      .definitions = {},
      .equations = {"(x - u)^2 + (y - v)^2 = r^2"}};
  const MechanismCalibration found = calibrate(circle, points);
  const auto squares = [&](double u, double v, double r) {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < points.rows(); ++i)
      sum += std::pow(std::hypot(points(i, 0) - u, points(i, 1) - v) - r, 2);
    return sum;
  };
  const Eigen::VectorXd& d = found.result.values;
  const double least = squares(d(0), d(1), d(2));
  EXPECT_NEAR(found.result.residuals.squaredNorm(), least, 1e-9 * least);
  for (const double step : {-1e-4, 1e-4}) {
    EXPECT_GT(squares(d(0) + step, d(1), d(2)), least);
    EXPECT_GT(squares(d(0), d(1) + step, d(2)), least);
    EXPECT_GT(squares(d(0), d(1), d(2) + step), least);
  }
}

// The paper's arm, eq. (12)-(13), as equations: the same minimum, covariance and calibrability as by the chain.
TEST(MechanismCalibration, ThePapersArmIsTheSameAsAChain) {
  const Robot flexible = read_robot(LLMT_ROBOTS_DIR "/planar_two_link.yaml");
  Robot rigid = flexible;
  rigid.effects.clear();
  Measurements training = measure(flexible, grid(rigid.chain, 0.1), 0.0, 1);
  training.measured = {true, true, false};
  discovery::LeastSquaresProblem problem = calibration_problem(rigid, training);
  for (discovery::Parameter& p : problem.parameters) {
    p.free = p.name == "joint2.a" || p.name == "joint2.b" || p.name == "tool.x" || p.name == "tool.y";
  }
  const discovery::SolverResult chain = discovery::solve(problem);
  const Mechanism arm = parse_mechanism(R"(
mechanism: planar arm
parameters: [{name: L2, value_mm: 1000}, {name: v2, value_mm: 0}, {name: L3, value_mm: 1000}, {name: v3, value_mm: 0}]
joints: [{name: phi12, start_deg: 0}, {name: phi23, start_deg: 90}]
outputs: [{name: x, start_mm: 1000}, {name: y, start_mm: 3000}]
equations:
  - L2*cos(phi12) + v2*sin(phi12) + L3*cos(phi12 + phi23) + v3*sin(phi12 + phi23) = x
  - 2000 + L2*sin(phi12) - v2*cos(phi12) + L3*sin(phi12 + phi23) - v3*cos(phi12 + phi23) = y
)",
                                        "arm");
  Eigen::MatrixXd measured(training.count(), 4);
  measured << training.poses.joints * 180.0 / std::numbers::pi, training.positions_mm.leftCols(2);
  const MechanismCalibration found = calibrate(arm, measured);
  const auto sign_of = [](const std::string& name) { return name == "v2" || name == "v3" ? -1.0 : 1.0; };
  const std::pair<const char*, const char*> same[] = {
      {"L2", "joint2.a"}, {"v2", "joint2.b"}, {"L3", "tool.x"}, {"v3", "tool.y"}};
  for (const auto& [own, other] : same) {
    EXPECT_NEAR(found.result.parameter(own).value, sign_of(own) * chain.parameter(other).value, 1e-7) << own;
    EXPECT_NEAR(found.result.standard_error(own), chain.standard_error(other), 1e-7) << own;
  }
  EXPECT_NEAR(found.result.calibrability, 1.784, 0.001);
}

TEST(MechanismCalibration, FiveBarIsFoundFromMeasuredPositions) {
  Random random(3);
  const Mechanism described = sample("five_bar.yaml");
  const Mechanism real = off_by(described, 1.0, 0.5, random);
  const Eigen::MatrixXd poses = poses_of(real, 60, random);
  const Eigen::MatrixXd measured = readings(real, poses, {{"q1", 0.0}, {"q2", 0.0}, {"x", 0.01}, {"y", 0.01}}, random);
  const MechanismCalibration found = calibrate(described, measured);
  EXPECT_TRUE(found.result.converged()) << found.result.reason;
  EXPECT_EQ(found.result.rank, 10);  // the offsets of p1 and p2 show nothing
  EXPECT_NEAR(found.result.sigma, 0.01, 0.002);
  for (std::size_t k = 0; k < real.parameters.size(); ++k) {
    const MechanismParameter& parameter = found.mechanism.parameters[k];
    if (!parameter.standard_error) continue;
    EXPECT_LT(std::abs(parameter.value - real.parameters[k].value), 4.0 * *parameter.standard_error) << parameter.name;
  }
  const Eigen::MatrixXd fresh = poses_of(real, 100, random);
  const Eigen::MatrixXd seen = readings(real, fresh, {{"q1", 0.0}, {"q2", 0.0}, {"x", 0.0}, {"y", 0.0}}, random);
  const auto rms = [](const MechanismErrors& errors) {
    return std::sqrt(errors.values.rightCols(2).rowwise().squaredNorm().mean());
  };
  EXPECT_GT(rms(errors_of(described, seen)), 0.5);
  EXPECT_LT(rms(errors_of(found.mechanism, seen)), 0.01);
}

// Four angles, three degrees of freedom: geometry without any instrument, but for the scale, which is given.
TEST(MechanismCalibration, ParallelRobotWithAFourthSensorCalibratesItself) {
  Random random(4);
  const Mechanism described = sample("planar_3rrr.yaml");
  const Mechanism real = off_by(described, 0.5, 0.3, random);
  const Eigen::MatrixXd poses = poses_of(real, 120, random);
  ASSERT_GT(poses.rows(), 100);
  const std::vector<std::pair<std::string, double>> sensors = {{"q1", 1e-3}, {"q2", 1e-3}, {"q3", 1e-3}, {"p1", 1e-3}};
  const MechanismCalibration found = calibrate(described, readings(real, poses, sensors, random));
  EXPECT_TRUE(found.result.converged()) << found.result.reason;
  EXPECT_EQ(found.result.rank, 15);
  EXPECT_NEAR(found.result.sigma, 1e-3, 2.5e-4);  // 105 degrees of freedom: +-7 %, three times that
  const Eigen::MatrixXd fresh = poses_of(real, 100, random);
  const Eigen::Index x = index_of(real, "x");
  const auto off = [&](const Mechanism& mechanism) {
    Eigen::MatrixXd known = fresh;
    known.rightCols(5).setConstant(NAN);
    known.col(index_of(real, "p1")).setConstant(NAN);
    const Eigen::MatrixXd gap = (assemble(mechanism, known).coordinates - fresh).middleCols(x, 2);
    return std::sqrt(gap.rowwise().squaredNorm().mean());
  };
  EXPECT_GT(off(described), 0.5);
  EXPECT_LT(off(found.mechanism), 0.1 * off(described));
}

// The described robot is 5 % off, so that it cannot take some poses of the real one, or takes them on another branch.
// 10 seeds with 15 parameters: one of 150 values of t with 65 degrees of freedom is beyond 5.5 once in ten thousand
// times.
TEST(MechanismCalibration, ParametersFarFromTheDescriptionAreFoundWithoutLosingAPose) {
  const Mechanism described = sample("planar_3rrr.yaml");
  for (int seed = 11; seed <= 20; ++seed) {
    Random random(1000 * seed + 7);
    Mechanism real = described;
    for (MechanismParameter& parameter : real.parameters) {
      const double size = parameter.unit == "mm" ? parameter.value : 180.0 / std::numbers::pi;
      if (!parameter.fixed) parameter.value += 0.05 * size * random.uniform(-1.0, 1.0);
    }
    const Eigen::MatrixXd poses = random_poses(real, 40, seed);
    const MechanismCalibration found = calibrate(
        described,
        readings(real, poses, {{"q1", 2e-3}, {"q2", 2e-3}, {"q3", 2e-3}, {"p1", 2e-3}, {"p2", 2e-3}}, random));
    EXPECT_TRUE(found.result.converged()) << seed << ": " << found.result.reason;
    EXPECT_TRUE(found.left_out.empty()) << seed << ": " << found.reasons.front();
    for (std::size_t k = 0; k < real.parameters.size(); ++k) {
      const MechanismParameter& parameter = found.mechanism.parameters[k];
      if (!parameter.standard_error) continue;
      EXPECT_LT(std::abs(parameter.value - real.parameters[k].value), 5.5 * *parameter.standard_error)
          << seed << ": " << parameter.name;
    }
  }
}

// A crank that is read as 359 degrees stands next to one that is read as 1 degree.
TEST(MechanismCalibration, WholeTurnsOfAnglesAreNoErrors) {
  const Mechanism crank{.name = "crank",
                        .parameters = {{.name = "offset", .unit = "deg"}},
                        .coordinates = {{.name = "q"}, {.name = "w", .output = true}},
                        .definitions = {},
                        .equations = {"sin(q + offset - w) = 0"}};
  const Eigen::MatrixXd measured = (Eigen::MatrixXd(2, 2) << 359.0, -0.5, 1.0, 361.5).finished();
  const MechanismErrors errors = errors_of(crank, measured);
  EXPECT_NEAR(errors.values(0, 1), 0.5, 1e-9);
  EXPECT_NEAR(errors.values(1, 1), 0.5, 1e-9);
}

TEST(MechanismCalibration, AnglesAloneDoNotShowTheScale) {
  Random random(5);
  Mechanism described = sample("planar_3rrr.yaml");
  described.parameters[0].fixed = false;
  const Eigen::MatrixXd poses = poses_of(described, 60, random);
  const MechanismCalibration found = calibrate(
      described, readings(described, poses, {{"q1", 1e-3}, {"q2", 1e-3}, {"q3", 1e-3}, {"p1", 1e-3}}, random));
  ASSERT_EQ(found.result.unidentifiable.size(), 1U);
  EXPECT_EQ(found.result.unidentifiable[0].terms.size(), 12U) << found.result.unidentifiable[0].names();
}

// Intervals of known noise: 60 runs with 10 parameters each, correlated within a run.
TEST(MechanismCalibration, StandardErrorsAreTheSpreadOfTheEstimates) {
  const Mechanism described = sample("five_bar.yaml");
  Random random(6);
  double squares = 0.0;
  int count = 0;
  const int runs = sampled(60, 15);
  for (int run = 0; run < runs; ++run) {
    const Mechanism real = off_by(described, 0.5, 0.3, random);
    const Eigen::MatrixXd poses = poses_of(real, 25, random);
    Mechanism start = described;
    start.coordinates[index_of(real, "q1")].sigma = 0.01;
    start.coordinates[index_of(real, "q2")].sigma = 0.01;
    start.coordinates[index_of(real, "x")].sigma = 0.03;
    start.coordinates[index_of(real, "y")].sigma = 0.03;
    const Eigen::MatrixXd measured =
        readings(real, poses, {{"q1", 0.01}, {"q2", 0.01}, {"x", 0.03}, {"y", 0.03}}, random);
    const MechanismCalibration found = calibrate(start, measured);
    ASSERT_TRUE(found.result.converged()) << found.result.reason;
    for (std::size_t k = 0; k < real.parameters.size(); ++k) {
      const MechanismParameter& parameter = found.mechanism.parameters[k];
      if (!parameter.standard_error) continue;
      squares += std::pow((parameter.value - real.parameters[k].value) / *parameter.standard_error, 2);
      ++count;
    }
  }
  // Mean of t^2 with 40 degrees of freedom: 40/38. Within a run the ten are dependent: of 60 runs 60 to 600 independent
  // values, variance of each about 2.3, three standard deviations of 60.
  EXPECT_EQ(count, 10 * runs);
  EXPECT_NEAR(squares / count, 40.0 / 38.0, 3.0 * std::sqrt(2.3 / runs));
}

TEST(MechanismCalibration, HeldOutErrorsTakeNoPart) {
  Random random(7);
  const Mechanism described = sample("five_bar.yaml");
  const Mechanism real = off_by(described, 1.0, 0.5, random);
  Eigen::MatrixXd measured =
      readings(real, poses_of(real, 30, random), {{"q1", 0}, {"q2", 0}, {"x", 0.01}, {"y", 0.01}}, random);
  const MechanismErrors before = held_out_errors(described, measured, {.count = 5});
  EXPECT_TRUE(before.of_outputs);
  EXPECT_LT(std::sqrt(before.values.rightCols(2).squaredNorm() / 60.0), 0.03);
  // A reading that is wrong by 5 mm is wrong by about that where it is held out, whatever the others say.
  measured(3, 4) += 5.0;
  EXPECT_NEAR(held_out_errors(described, measured, {.count = static_cast<int>(measured.rows())}).values(3, 4), 5.0,
              0.1);
}

TEST(MechanismCalibration, PosesThatCannotBeTakenAreLeftOutByNumber) {
  Random random(8);
  const Mechanism described = sample("five_bar.yaml");
  Eigen::MatrixXd measured =
      readings(described, poses_of(described, 20, random), {{"q1", 0}, {"q2", 0}, {"p1", 1e-3}}, random);
  measured.row(4).head(2) << 179.0, 1.0;  // the elbows are 700 mm apart, the couplers reach 600
  const MechanismCalibration found = calibrate(described, measured);
  ASSERT_EQ(found.left_out, std::vector<Eigen::Index>{4});
  EXPECT_EQ(found.corrections.row(4).norm(), 0.0);
}

TEST(MechanismCalibration, WhatCannotBeCalibratedIsRefused) {
  Random random(9);
  Mechanism described = sample("five_bar.yaml");
  const Eigen::MatrixXd poses = poses_of(described, 10, random);
  const auto expect_refused = [&](const Mechanism& mechanism, const Eigen::MatrixXd& measured, const char* words) {
    try {
      calibrate(mechanism, measured);
      ADD_FAILURE() << "accepted, expected: " << words;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  expect_refused(described, readings(described, poses, {{"q1", 0}, {"q2", 0}}, random),
                 "no reading checks another one");
  expect_refused(described, readings(described, poses, {{"q1", 0}}, random), "cannot tell them");
  expect_refused(described, poses.leftCols(3), "3 coordinates");
  Mechanism exact = described;
  for (Coordinate& coordinate : exact.coordinates) coordinate.sigma = 0.0;
  expect_refused(exact, poses, "have noise");
  Mechanism mixed = sample("planar_3rrr.yaml");
  const Eigen::MatrixXd seen = poses_of(mixed, 10, random);
  expect_refused(mixed, seen, "state the sigma of each");  // x in mm, phi in deg
}

}  // namespace
}  // namespace llmt::robotics
