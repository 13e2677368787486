// Derivatives by the values of effects against differences of positions.
#include <gtest/gtest.h>

#include "llmt/robotics/catalogue.hpp"
#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

// Every type at every place where it may be, values 0.
std::vector<Effect> all_effects(const Chain& chain) {
  std::vector<Effect> all;
  for (const EffectType& type : effect_types()) {
    const std::size_t places = type.place == EffectPlace::robot ? 1 : chain.joints.size();
    for (std::size_t index = 0; index < places && type.name != "formula"; ++index) {
      if (suits(type, chain, index)) all.push_back(make_effect(type, chain, index, {}, 20));
    }
  }
  return all;
}

Robot baseline(Robot robot) {
  robot = weighted(std::move(robot));
  robot.effects = {{"joint_compliance", "joint2", {1e-7}}, {"link_bending", "joint1", {1e-8}}};
  return robot;
}

// Central differences of positions(), one effect on top of the robot, steps of `share` of the value's size.
Eigen::MatrixXd differences(const Robot& robot, const Effect& effect, const Poses& poses, double share) {
  const std::vector<EffectParameter> parameters = effect_parameters(robot.chain, effect);
  Eigen::MatrixXd columns(3 * poses.count(), std::ssize(effect.values));
  for (std::size_t k = 0; k < effect.values.size(); ++k) {
    const double step = share * parameters[k].scale;
    const auto moved = [&](double change) -> Eigen::MatrixXd {
      Effect other = effect;
      other.values[k] += change;
      return positions(with_effect(robot, other), poses).transpose();
    };
    const Eigen::MatrixXd slope = (moved(step) - moved(-step)) / (2.0 * step);
    columns.col(k) = slope.reshaped();
  }
  return columns;
}

TEST(EffectDerivatives, SignaturesAreDifferencesOfPositionsAtZero) {
  for (const Robot& robot : {baseline(ur_like()), baseline(mdh_like()), slanted(baseline(scara()))}) {
    const Poses poses = furnished_poses(robot.chain, 6, 1);
    const std::vector<Effect> candidates = all_effects(robot.chain);
    ASSERT_GT(candidates.size(), 60U);
    const Eigen::MatrixXd signatures = effect_signatures(robot, candidates, poses);
    Eigen::Index first = 0;
    for (const Effect& candidate : candidates) {
      // What changes gravity or payload moves the tool too little for small steps, and is as good as linear.
      const double share = effect_type(candidate.type).adjust ? 1.0 : 1e-3;
      const Eigen::MatrixXd expected = differences(robot, candidate, poses, share);
      const Eigen::MatrixXd own = signatures.middleCols(first, expected.cols());
      first += expected.cols();
      for (Eigen::Index k = 0; k < own.cols(); ++k) {
        const double size = expected.col(k).norm();
        // The robot's own effects deform it: signatures are of first order, exact to its deflections over its levers. A
        // nanometre at the value's typical size is nothing.
        const double scale = effect_parameters(robot.chain, candidate)[k].scale;
        EXPECT_LT((own.col(k) - expected.col(k)).norm(), 2e-3 * size + 1e-6 / scale)
            << effect_label(candidate) << " value " << k;
      }
    }
    EXPECT_EQ(first, signatures.cols());
  }
}

TEST(EffectDerivatives, SignaturesDoNotDependOnTheCompanyOrOnTheValuesGiven) {
  const Robot robot = baseline(ur_like());
  const Poses poses = furnished_poses(robot.chain, 4, 2);
  std::vector<Effect> candidates = all_effects(robot.chain);
  const Eigen::MatrixXd together = effect_signatures(robot, candidates, poses);
  Eigen::Index first = 0;
  for (Effect& candidate : candidates) {
    const Eigen::Index own = std::ssize(candidate.values);
    for (double& value : candidate.values) value = 0.1;
    EXPECT_EQ(effect_signatures(robot, {candidate}, poses), together.middleCols(first, own)) << effect_label(candidate);
    first += own;
  }
}

// The largest error of a column of the Jacobian over the norm of the column. The oracle are central differences of
// positions(), extrapolated (Richardson): their error is of fourth order in the step, and rounding.
double largest_error(const Robot& robot, const Poses& poses) {
  const Eigen::MatrixXd jacobian = position_jacobian(robot, poses);
  const std::vector<discovery::Parameter> all = parameters(robot);
  Eigen::VectorXd values(std::ssize(all));
  for (std::size_t i = 0; i < all.size(); ++i) values(static_cast<Eigen::Index>(i)) = all[i].value;
  // Coordinates of metres have 2e-13 mm, and some ten operations each of some ten coordinates are rounded.
  constexpr double rounding_mm = 2e-11;
  double largest = 0.0;
  for (Eigen::Index k = 0; k < jacobian.cols(); ++k) {
    const auto slope = [&](double step) -> Eigen::VectorXd {
      Eigen::VectorXd above = values;
      Eigen::VectorXd below = values;
      above(k) += step;
      below(k) -= step;
      const Eigen::MatrixXd moved =
          positions(with_values(robot, above), poses) - positions(with_values(robot, below), poses);
      return moved.transpose().reshaped() / (2.0 * step);
    };
    // 0.05 mm, 0.005 deg, a twentieth of an effect's value.
    const bool is_of_effect = k >= geometric_parameter_count(robot.chain) && values(k) != 0.0;
    const double step = 0.05 * (is_of_effect ? std::abs(values(k)) : all[k].scale);
    const Eigen::VectorXd expected = (4.0 * slope(0.5 * step) - slope(step)) / 3.0;
    const double error = (jacobian.col(k) - expected).norm() - rounding_mm / step;
    if (error > 0.0) largest = std::max(largest, error / expected.norm());
  }
  return largest;
}

// The effect at its typical size, or as much smaller as keeps the tool within 3 mm: these arms are heavy, and columns
// such as time_s count thousands of seconds.
Effect typical(const Robot& arm, Effect effect, const Poses& poses, Random& random) {
  constexpr double most_mm = 3.0;
  const std::vector<EffectParameter> own = effect_parameters(arm.chain, effect);
  for (std::size_t k = 0; k < own.size(); ++k) effect.values[k] = own[k].scale * (random.uniform() < 0.5 ? -1.0 : 1.0);
  const Eigen::MatrixXd moved = positions(with_effect(arm, effect), poses) - positions(arm, poses);
  const double longest = moved.rowwise().norm().maxCoeff();
  for (double& value : effect.values) value *= std::min(1.0, most_mm / longest);
  return effect;
}

// An arm that bends, and one effect.
Robot bending(const Robot& arm, const Effect& effect) {
  Robot robot = arm;
  for (const Effect& other : {Effect{"joint_compliance", "joint1", {1e-6}},
                              {"joint_compliance", "joint2", {1e-6}},
                              {"link_torsion", "joint2", {1e-7}}}) {
    if (effect_label(effect) != effect_label(other)) robot.effects.push_back(other);
  }
  return with_effect(std::move(robot), effect);
}

TEST(EffectDerivatives, JacobianIsThatOfDifferencesWithEveryEffectAtItsTypicalSize) {
  Random random(7);
  for (const Robot& arm :
       {weighted(ur_like()), weighted(slanted(mdh_like())), weighted(slanted(scara())), weighted(seven_axes())}) {
    // At none of these poses does a torque change its sign within the steps.
    const Poses poses = furnished_poses(arm.chain, 5, 5);
    for (const Effect& any : all_effects(arm.chain)) {
      const Effect effect = typical(arm, any, poses, random);
      EXPECT_LT(largest_error(bending(arm, effect), poses), 1e-7) << effect_label(effect) << " and others";
      EXPECT_LT(largest_error(with_effect(arm, effect), poses), 1e-7) << effect_label(effect) << " alone";
    }
  }
}

TEST(EffectDerivatives, JacobianIsThatOfDifferencesWithManyEffectsTogether) {
  Robot robot = baseline(slanted(ur_like()));
  robot.effects.push_back({"eccentricity", "joint3", {1e-3, -2e-3}});
  robot.effects.push_back({"payload_error", "", {1.0, 10.0, 20.0, -30.0}});
  robot.effects.push_back({"counterbalance_spring", "joint2", {1e-3, 5e-4}, {0.4, 0.3}});
  robot.effects.push_back({"gravity_tilt", "", {1e-3, -2e-3}});
  robot.effects.push_back({"axis_wobble", "joint1", {1e-4, 1e-4, -1e-4, 0.0}});
  robot.effects.push_back({"elastic_base", "", {1e-6}});
  robot.effects.push_back(
      {"formula", "joint4", {1e-6}, {}, {"load", {{"joint", "tau2 * cos(q4) + tau4", "", "", 1e-6}}}});
  robot.effects.push_back({"instrument_azimuth", "", {1e-4, -1e-4}});
  EXPECT_LT(largest_error(robot, furnished_poses(robot.chain, 6, 3)), 1e-7);
  Poses turned = furnished_poses(robot.chain, 4, 4);
  turned.observations.assign(4, {.reading = Reading::orientation, .reference = Eigen::Matrix3d::Identity()});
  for (Eigen::Index i = 0; i < 4; ++i) {
    const Pose tool = tool_poses(robot, select(turned, {i}))[0];
    turned.observations[i].reference = Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY()) * tool.rotation;
  }
  EXPECT_LT(largest_error(robot, turned), 1e-7);
}

TEST(EffectDerivatives, OwnEffectsHaveSignaturesToo) {
  const std::vector<EffectType> types = parse_catalogue(R"yaml(effects:
  - formula: belt
    place: joint
    terms:
      - {joint: "cos(37 * q{})", scale: 1e-4, lower: -1, upper: 1}
      - {joint: "dir{} * sin(37 * q{})", scale: 1e-4, lower: -1, upper: 1}
  - formula: roof
    place: robot
    terms:
      - {z: "temp_C - 20", scale: 0.01, lower: -1, upper: 1}
)yaml",
                                                        "own.yaml");
  const Robot robot = baseline(ur_like());
  const Poses poses = furnished_poses(robot.chain, 5, 5);
  const std::vector<Effect> own = {make_effect(types[types.size() - 2], robot.chain, 1),
                                   make_effect(types.back(), robot.chain, 0)};
  EXPECT_EQ(types[types.size() - 2].columns, std::vector<std::string>{"dir{}"});
  EXPECT_EQ(effect_parameters(types.back(), robot.chain, own[1])[0].upper, 1.0);
  const Eigen::MatrixXd signatures = effect_signatures(robot, own, poses);
  const Robot rigid = weighted(ur_like());
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const Eigen::VectorXd q = poses.joints.row(i).transpose();
    const Eigen::Vector3d lever = (moved_tool(rigid, q, 1, 1e-6) - moved_tool(rigid, q, 1, -1e-6)) / 2e-6;
    const Eigen::MatrixXd rows = signatures.middleRows(3 * i, 3);
    const double direction = column_of(poses, "dir2", i);
    EXPECT_LT((rows.col(0) - std::cos(37.0 * q(1)) * lever).norm(), 1e-1);
    EXPECT_LT((rows.col(1) - direction * std::sin(37.0 * q(1)) * lever).norm(), 1e-1);
    EXPECT_LT((rows.col(2) - Eigen::Vector3d(0.0, 0.0, column_of(poses, "temp_C", i) - 20.0)).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace llmt::robotics
