// Names that hold: in refits, with one sign, at joints that move, and of a torque that is known.
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "discovery/judges/judges.hpp"
#include "discovery/refits.hpp"
#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/effects.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

Name compliance(const char* at, double value, double error) {
  Name name;
  name.effect.effect = {.type = "joint_compliance_measured", .at = at, .values = {value}, .constants = {}};
  name.effect.parameters = {{"compliance", value, "rad/(N m)", error}};
  return name;
}

Findings found_with(const std::vector<Name>& names) {
  Findings found;
  found.verdict = discovery::Answer::named;
  found.investigation.fitted.robot = ur_like();
  found.investigation.searched.poses = random_poses(ur_like().chain, 30, 1);
  found.names = names;
  return found;
}

std::vector<std::size_t> against(const Findings& found, Reason reason) {
  for (const Objection& one : judge_names(found, {})) {
    if (one.reason == reason) return one.names;
  }
  return {};
}

using Numbers = std::vector<std::size_t>;

TEST(NamesHold, CompliancesOfBothSignsAreNotConfirmed) {
  EXPECT_EQ(
      against(found_with({compliance("joint2", 7e-5, 1e-6), compliance("joint4", -5e-4, 1e-5)}), Reason::both_signs),
      (Numbers{0, 1}));
  EXPECT_EQ(
      against(found_with({compliance("joint2", -7e-5, 1e-6), compliance("joint4", -5e-4, 1e-5)}), Reason::both_signs),
      Numbers{});
  // A value within its error has no sign.
  EXPECT_EQ(
      against(found_with({compliance("joint2", 7e-5, 1e-6), compliance("joint4", -5e-6, 1e-5)}), Reason::both_signs),
      Numbers{});
}

TEST(NamesHold, AJointThatStandsStillHasNoEffect) {
  Findings found = found_with({compliance("joint2", 7e-5, 1e-6), compliance("joint6", 5e-4, 1e-5)});
  EXPECT_EQ(against(found, Reason::still_joint), Numbers{});
  found.investigation.searched.poses.joints.col(5).setConstant(0.3);
  EXPECT_EQ(against(found, Reason::still_joint), Numbers{1});
}

TEST(NamesHold, AValueThatWasHeldIsNotDetermined) {
  const double held = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(against(found_with({compliance("joint2", 0.0, held), compliance("joint4", 1e-4, held),
                                compliance("joint3", 1e-4, 1e-5)}),
                    Reason::undetermined),
            (Numbers{0, 1}));
}

TEST(NamesHold, FourOfFiveRefitsAreEnough) {
  Refits refits;
  refits.count = 5;
  for (const int held : {5, 4, 3}) refits.names.push_back({held, {}});
  ASSERT_TRUE(judge_refits(refits));
  EXPECT_EQ(judge_refits(refits)->names, Numbers{2});
  refits.names.pop_back();
  EXPECT_FALSE(judge_refits(refits));
}

Robot arm_with_compliance(double compliance) {
  Robot robot = read_robot(LLMT_ROBOTS_DIR "/tx200_like.yaml");
  robot.effects = {make_effect(effect_type("joint_compliance"), robot.chain, 1)};
  robot.effects[0].values = {compliance};
  return robot;
}

TEST(NamesHold, AnEffectThatIsThereHoldsInAllRefits) {
  constexpr double truth = 4e-7;
  const Robot real = arm_with_compliance(truth);
  Robot described = real;
  described.effects.clear();
  const Discovery found = discover(described, simulate(real, {.poses = 80, .noise_um = 20.0, .seed = 3}), {}, {});
  const auto own = std::ranges::find_if(found.effects, [](const FoundEffect& one) {
    return one.effect.type == "joint_compliance" && one.effect.at == "joint2";
  });
  ASSERT_NE(own, found.effects.end());
  EXPECT_EQ(own->refits, 5);
  EXPECT_EQ(own->held, 5);
  ASSERT_EQ(own->ranges.size(), 1U);
  EXPECT_LT(own->ranges[0][0], own->ranges[0][1]);
  EXPECT_NEAR(0.5 * (own->ranges[0][0] + own->ranges[0][1]), truth, 0.1 * truth);
}

// The torque is that of the payload alone, and so the compliance would be several times too large.
TEST(NamesHold, AStatedPayloadWithoutMassesMakesNoSize) {
  const Robot real = arm_with_compliance(2e-6);
  Robot described = real;
  described.effects.clear();
  for (Joint& joint : described.chain.joints) joint.mass_kg = 0.0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Measurements seen = simulate(real, {.poses = 100, .noise_um = 20.0, .seed = seed});
    seen.poses.covariates["payload_kg"] = Eigen::VectorXd::Constant(seen.count(), 12.0);
    seen.positions_mm = simulate(real, {.poses = 100, .noise_um = 20.0, .seed = seed}).positions_mm;
    const Discovery found = discover(described, seen, {}, {});
    for (const FoundEffect& one : found.effects) EXPECT_NE(one.effect.type, "joint_compliance") << seed;
    EXPECT_LT(found.held_out.after.mean, 0.5 * found.held_out.before.mean) << seed;
  }
}

// What is searched for by default, but for one type.
std::vector<EffectType> catalogue_without(const std::string& type) {
  std::vector<EffectType> types = effect_types();
  std::erase_if(types, [&](const EffectType& own) { return own.name == type; });
  return types;
}

TEST(NamesHold, APayloadThatNobodyStatedIsAskedFor) {
  Robot real = arm_with_compliance(2e-6);
  real.effects.push_back({"joint_compliance", "joint3", {3e-6}, {}});
  Robot described = real;
  described.effects.clear();
  real.chain.payload.mass_kg = 25.0;
  Measurements seen = simulate(real, {.poses = 120, .noise_um = 20.0, .seed = 5});
  DiscoveryOptions options;
  options.catalogue = catalogue_without("payload_error");  // which would be named itself
  const Discovery found = discover(described, seen, {}, options);
  ASSERT_EQ(found.could_state.size(), 1U);
  EXPECT_EQ(found.could_state[0].substr(0, 18), "State the payload ") << found.could_state[0];
  double mass = 0.0;
  ASSERT_EQ(std::sscanf(found.could_state[0].c_str() + found.could_state[0].find("with "), "with %lf kg", &mass), 1);
  EXPECT_NEAR(mass, 25.0, 5.0) << found.could_state[0];
  seen.poses.covariates["payload_kg"] = Eigen::VectorXd::Constant(seen.count(), 25.0);
  EXPECT_TRUE(discover(described, seen, {}, options).could_state.empty());
}

// The instrument's range is off by 1 mm: no error of the arm explains that, so the name stands.
TEST(NamesHold, AnErrorOfTheInstrumentHasNoRivalOfTheArmWhereItIsReal) {
  Robot real = arm_with_compliance(1e-7);
  real.chain.base.xyz_mm = {2500.0, 800.0, -300.0};
  Robot described = real;
  described.effects.clear();
  real.effects = {{"instrument_range", "", {1.0}, {}}};
  const Discovery found = discover(described, simulate(real, {.poses = 120, .noise_um = 20.0, .seed = 5}), {}, {});
  const auto own =
      std::ranges::find_if(found.effects, [](const FoundEffect& one) { return one.effect.type == "instrument_range"; });
  ASSERT_NE(own, found.effects.end());
  EXPECT_TRUE(own->confirmed);
  EXPECT_NEAR(own->parameters[0].value, 1.0, 0.2);
}

}  // namespace
}  // namespace llmt::robotics
