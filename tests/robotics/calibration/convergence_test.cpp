// A description with effects, as discovery writes it, is calibrated again.
#include <gtest/gtest.h>

#include <cmath>

#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/effects.hpp"
#include "study.hpp"

namespace llmt::robotics {
namespace {

// Every type that discovery looks for, once, at the second joint or at the next where it may be; twice its typical
// size.
std::vector<Effect> one_of_each(const Chain& chain) {
  std::vector<Effect> all;
  for (const EffectType& type : effect_types()) {
    if (!type.searched || type.name == "formula" || type.name == "joint_map" || type.name == "tracker_knock") continue;
    const std::size_t places = type.place == EffectPlace::robot ? 1 : chain.joints.size();
    for (std::size_t index = std::min<std::size_t>(1, places - 1); index < places; ++index) {
      if (!suits(type, chain, index)) continue;
      // The session lasts an hour, see furnished_poses().
      const std::vector<double> constants = type.name == "drift_settling" ? std::vector<double>{0.0, 3600.0, 0.2}
                                            : type.family == "drift"      ? std::vector<double>{0.0, 3600.0}
                                                                          : std::vector<double>{};
      Effect effect = make_effect(type, chain, index, constants, 0);
      const std::vector<EffectParameter> own = effect_parameters(chain, effect);
      for (std::size_t k = 0; k < own.size(); ++k) effect.values[k] = 2.0 * own[k].scale;
      all.push_back(std::move(effect));
      break;
    }
  }
  return all;
}

Robot with_effects(Robot robot, std::vector<Effect> effects) {
  robot.effects = std::move(effects);
  return robot;
}

// Measured on the true arm; the description is tenths of a millimetre and a tenth of each effect off.
Calibration calibrated_again(const Robot& truth, std::uint64_t seed) {
  const Measurements measurements =
      simulate(truth, furnished_poses(truth.chain, 80, seed), {.noise_um = 20.0, .seed = seed});
  Robot described = truth;
  Random random(seed + 1);
  for (Joint& joint : described.chain.joints) {
    joint.a_mm += 0.3 * random.normal();
    joint.d_mm += 0.3 * random.normal();
    joint.theta_deg += 0.02 * random.normal();
  }
  for (Effect& effect : described.effects) {
    for (double& value : effect.values) value *= 1.0 + 0.1 * random.normal();
  }
  return calibrate(described, measurements);
}

void expect_converged(const Robot& truth, std::uint64_t seed) {
  std::string names;
  for (const Effect& effect : truth.effects) names += effect_label(effect) + " ";
  const Calibration calibration = calibrated_again(truth, seed);
  EXPECT_TRUE(calibration.result.converged()) << names << calibration.result.reason;
  // Mean square of normal noise: 240 coordinates, of which some 40 are fitted, six standard deviations.
  EXPECT_LT(calibration.noise_mm, 0.02 * (1.0 + 6.0 / std::sqrt(2.0 * 200.0))) << names;
}

TEST(Calibration, ConvergesWithEveryEffectAndEveryPairOfThem) {
  const Robot arm = weighted(ur_like(), false);
  const std::vector<Effect> effects = one_of_each(arm.chain);
  ASSERT_GT(effects.size(), 25U);
  std::uint64_t seed = 1;
  for (std::size_t one = 0; one < effects.size(); ++one) {
    expect_converged(with_effects(arm, {effects[one]}), ++seed);
    for (std::size_t other = one + 1; other < effects.size(); ++other) {
      // Every third pair: with each number of effects all kinds meet. The gate takes every twelfth.
      if ((one + other) % sampled(3, 12) == 0)
        expect_converged(with_effects(arm, {effects[one], effects[other]}), ++seed);
    }
  }
}

}  // namespace
}  // namespace llmt::robotics
