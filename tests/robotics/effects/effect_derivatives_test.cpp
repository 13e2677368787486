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

TEST(EffectDerivatives, JacobianIsThatOfPositionsAtValuesOtherThanZero) {
  Robot robot = baseline(ur_like());
  robot.effects.push_back({"eccentricity", "joint3", {0.02, -0.03}});
  robot.effects.push_back({"payload_error", "", {1.0, 10.0, 20.0, -30.0}});
  robot.effects.push_back({"counterbalance_spring", "joint2", {1e-3, 5e-4}, {0.4, 0.3}});
  robot.effects.push_back({"gravity_tilt", "", {1e-3, -2e-3}});
  robot.effects.push_back({"axis_wobble", "joint1", {1e-4, 1e-4, -1e-4, 0.0}});
  const Poses poses = furnished_poses(robot.chain, 6, 3);
  const Eigen::MatrixXd jacobian = position_jacobian(robot, poses);
  const std::vector<discovery::Parameter> all = parameters(robot);
  Eigen::VectorXd values(std::ssize(all));
  for (std::size_t k = 0; k < all.size(); ++k) values(k) = all[k].value;
  for (Eigen::Index k = geometric_parameter_count(robot.chain); k < values.size(); ++k) {
    const double step = 0.1 * all[k].scale;
    const auto moved = [&](double change) -> Eigen::MatrixXd {
      Eigen::VectorXd other = values;
      other(k) += change;
      return positions(with_values(robot, other), poses).transpose();
    };
    const Eigen::VectorXd expected = ((moved(step) - moved(-step)) / (2.0 * step)).reshaped();
    // Effect columns are of first order at the deformed arm; the eccentricity turns a joint by 0.036 rad.
    EXPECT_LT((jacobian.col(k) - expected).norm(), 0.04 * expected.norm() + 1e-6) << all[k].name;
  }
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
