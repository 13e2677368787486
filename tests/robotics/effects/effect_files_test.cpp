// Effects in robot descriptions and catalogues of one's own.
#include <gtest/gtest.h>

#include <algorithm>

#include "llmt/robotics/catalogue.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "oracles/thrown.hpp"
#include "robotics/effects.hpp"

namespace llmt::robotics {
namespace {

// Every type of effect at every place, with numbers that are not round.
Robot with_all_effects(Robot robot) {
  Random random(3);
  for (const EffectType& type : effect_types()) {
    const std::size_t places = type.place == EffectPlace::robot ? 1 : robot.chain.joints.size();
    for (std::size_t index = 0; index < places && type.name != "formula"; ++index) {
      if (!suits(type, robot.chain, index)) continue;
      Effect effect = make_effect(type, robot.chain, index, {}, 7);
      for (double& value : effect.values) value = random.normal() * 1e-5;
      for (double& value : effect.constants) value = random.uniform(0.1, 50.0);
      robot.effects.push_back(effect);
    }
  }
  robot.effects.push_back(
      {.type = "formula",
       .at = "joint2",
       .values = {1.0 / 3.0, -2e-7},
       .formula = {"belt pitch: #1",
                   {{"joint", "cos(3*q2)", "cosine", "rad", 1e-5}, {"z", "temp_C > 20 ? 1 : \"0\""}}}});
  robot.effects.back().formula.terms[1].text = "temp_C > 20 ? 1 : 0";
  robot.effects.push_back(
      {.type = "formula", .at = "", .values = {0.1}, .formula = {"roof", {{"y", "tau1 * payload_kg"}}}});
  return robot;
}

void expect_same_effects(const Robot& a, const Robot& b) {
  ASSERT_EQ(a.effects.size(), b.effects.size());
  for (std::size_t e = 0; e < a.effects.size(); ++e) {
    EXPECT_EQ(effect_label(a.effects[e]), effect_label(b.effects[e]));
    EXPECT_EQ(a.effects[e].values, b.effects[e].values);
    EXPECT_EQ(a.effects[e].constants, b.effects[e].constants);
    ASSERT_EQ(a.effects[e].formula.terms.size(), b.effects[e].formula.terms.size());
    for (std::size_t k = 0; k < a.effects[e].formula.terms.size(); ++k) {
      const FormulaTerm& p = a.effects[e].formula.terms[k];
      const FormulaTerm& q = b.effects[e].formula.terms[k];
      EXPECT_EQ(std::tie(p.acts_on, p.text, p.name, p.unit, p.scale),
                std::tie(q.acts_on, q.text, q.name, q.unit, q.scale));
    }
  }
}

TEST(EffectFiles, EveryEffectSurvivesWritingToTheLastBit) {
  for (const Robot& arm : {ur_like(), scara()}) {
    Robot robot = with_all_effects(weighted(arm));
    for (const discovery::Parameter& parameter : parameters(robot)) {
      robot.identified.push_back({parameter.name, 0.1 + 0.2, "free"});
    }
    const std::string text = to_yaml(robot);
    const Robot again = parse_robot(text, "again.yaml");
    expect_same_effects(again, robot);
    EXPECT_EQ(to_yaml(again), text);
    ASSERT_EQ(again.identified.size(), robot.identified.size());
    EXPECT_EQ(again.identified.back().standard_error, robot.identified.back().standard_error);
  }
}

TEST(EffectFiles, KeysSayUnitsOfTheJointTheyAreAt) {
  Robot robot = scara();
  robot.effects = {{"joint_compliance", "joint3", {1e-7}},
                   {"joint_map", "joint3", {0.1, 0.2}, {0.0, 100.0}},
                   {"transmission_error", "joint1", {1e-5, 2e-5}, {202.0}}};
  const std::string text = to_yaml(robot);
  EXPECT_NE(text.find("{type: joint_compliance, at: joint3, compliance_m_per_N: 1e-07}"), std::string::npos) << text;
  EXPECT_NE(text.find("first_mm: 0, step_mm: 100, values_mm: [0.1, 0.2]"), std::string::npos) << text;
  EXPECT_NE(text.find("order_per_turn: 202, cosine_rad: 1e-05, sine_rad: 2e-05"), std::string::npos) << text;
  EXPECT_EQ(parameters(robot).at(parameters(robot).size() - 3).name, "joint_map@joint3[0,100].value_2");
  EXPECT_EQ(parameters(robot).at(parameters(robot).size() - 3).unit, "mm");
}

std::string arm_with(const std::string& effect) {
  std::string text = "name: arm\nconvention: dh\njoints:\n";
  for (const char* joint : {"joint1, type: revolute", "joint2, type: prismatic"}) {
    text += std::string("  - {name: ") + joint + ", alpha_deg: 0, a_mm: 100, d_mm: 0, theta_deg: 0}\n";
  }
  return text + "effects:\n  - {" + effect + "}\n";  // in line 7
}

void expect_refused(const std::string& effect, const std::string& part) {
  try {
    parse_robot(arm_with(effect), "arm.yaml");
    ADD_FAILURE() << effect << " was accepted";
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with("arm.yaml:7: effects[0]")) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
  }
}

TEST(EffectFiles, MistakesNameLineEffectAndWhatWouldBeRight) {
  EXPECT_NO_THROW(parse_robot(arm_with("type: joint_gain, at: joint1, gain: 0"), "arm.yaml"));
  expect_refused("type: eccentricity, at: joint2, cosine_rad: 0, sine_rad: 0",
                 "eccentricity@joint2: joint2 is prismatic");
  expect_refused("type: transmission_error, at: joint1, cosine_rad: 0, sine_rad: 0", "\"order_per_turn\" is missing");
  expect_refused("type: transmission_error, at: joint1, order_per_turn: 0, cosine_rad: 0, sine_rad: 0", "must be > 0");
  expect_refused("type: joint_map, at: joint2, first_rad: 0, step_rad: 1, values_rad: [0]", "\"first_mm\" is missing");
  expect_refused("type: joint_map, at: joint1, first_rad: 0, step_rad: 1, values_rad: []", "has 0 values, must be 1");
  expect_refused("type: joint_map, at: joint1, first_rad: 0, step_rad: 1, values_rad: 3", "must be a list of numbers");
  expect_refused("type: joint_compliance_free_masses, at: joint1, moments_rad: [1, 2, 3]", "has 3 values, must be 6");
  expect_refused("type: drift, from: 3, to: 3, vx_mm: 0, vy_mm: 0, vz_mm: 0", "from and to must differ");
  expect_refused("type: elastic_base, at: joint1, compliance_rad_per_Nm: 0", "unknown key \"at\"");
  const std::string formula = "type: formula, name: own, coefficients: [1], ";
  EXPECT_NO_THROW(parse_robot(arm_with(formula + "at: joint1, terms: [{joint: sin(q1)}]"), "arm.yaml"));
  expect_refused(formula + "at: joint1, terms: [{joint: sin(q1}]", "of \"sin(q1\": ");
  expect_refused(formula + "at: joint1, terms: [{joint: q1=3}]", "column 3 of \"q1=3\": == compares; = is not allowed");
  expect_refused(formula + "at: joint1, terms: [{joint: sin(q3)}]", "names q3, the robot has 2 joints");
  expect_refused(formula + "terms: [{joint: sin(q1)}]", "there is no \"at\"");
  expect_refused(formula + "terms: [{x: q1, y: q1}]", "one of joint, x, y, z");
  expect_refused(formula + "terms: [{x: q1, scale: 0}]", "\"scale\" is 0, must be > 0");
  expect_refused(formula + "terms: [{text: q1}]", "needs one of the keys");
  expect_refused(formula + "terms: [{x: q1}, {y: q1}]", "has 1 values, must be 2");
}

TEST(EffectFiles, MistakesInTermsAreFoundAtTheirLine) {
  const std::string text = arm_with("type: joint_gain, at: joint1, gain: 0") +
                           "  - type: formula\n    name: own\n    coefficients: [1, 1]\n    terms:\n      - x: q1\n"
                           "      - unit: mm\n        y: q1 = 2\n";  // in line 14
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { parse_robot(text, "arm.yaml"); }),
            "arm.yaml:14: effects[1].terms[1]: column 4 of \"q1 = 2\": == compares; = is not allowed");
}

std::string map_of(std::size_t values) {
  std::string text = "type: joint_map, at: joint1, first_rad: 0, step_rad: 0.001, values_rad: [0";
  for (std::size_t k = 1; k < values; ++k) text += ",0";
  return text + "]";
}

TEST(EffectFiles, SizesAreBounded) {
  EXPECT_EQ(parse_robot(arm_with(map_of(10000)), "arm.yaml").effects.front().values.size(), 10000U);
  expect_refused(map_of(10001), "\"values_rad\" has 10001 numbers, at most 10000 are read");
  EXPECT_EQ(oracle::thrown<std::runtime_error>([] {
              parse_robot(arm_with(map_of(9999)) + "  - {type: drift, from: 0, to: 1, vx_mm: 0, vy_mm: 0, vz_mm: 0}\n",
                          "arm.yaml");
            }),
            "arm.yaml:8: effects[1]: the effects have 10002 values up to here, at most 10000 are possible");
  const std::string many =
      oracle::thrown<std::runtime_error>([] { parse_robot(arm_with(map_of(400000)), "arm.yaml"); });
  EXPECT_EQ(many, "arm.yaml:7: more than 300000 keys, values and lists");
}

TEST(Catalogue, TableAndFormulasHaveTheSameParameters) {
  for (const EffectType& type : effect_types()) {
    EXPECT_FALSE(type.family.empty() || type.title.empty() || type.formula.empty() || type.source.empty()) << type.name;
    EXPECT_FALSE(type.note.empty()) << type.name;
    EXPECT_TRUE(type.apply || type.adjust || type.name == "formula") << type.name;
    for (const EffectParameter& parameter : type.parameters) {
      EXPECT_LT(parameter.lower, parameter.upper) << type.name << parameter.name;
      EXPECT_LE(parameter.lower, 0.2 * parameter.scale) << type.name;  // 0, or what is as good as not there
      EXPECT_LE(parameter.scale, parameter.upper) << type.name << parameter.name;
      EXPECT_FALSE(parameter.key.empty()) << type.name;
    }
  }
}

TEST(Catalogue, FileChangesWhatItNamesAndKeepsTheRest) {
  const std::vector<EffectType> types = parse_catalogue(R"(effects:
  - {type: joint_gain, search: false, title: scale, parameters: {gain: {upper: 1}}}
)",
                                                        "own.yaml");
  ASSERT_EQ(types.size(), effect_types().size());
  const EffectType& before = effect_type("joint_gain");
  const EffectType& after = *std::ranges::find(types, "joint_gain", &EffectType::name);
  EXPECT_FALSE(after.searched);
  EXPECT_EQ(after.title, "scale");
  EXPECT_EQ(after.note, before.note);
  EXPECT_EQ(after.parameters[0].upper, 1.0);
  EXPECT_EQ(after.parameters[0].lower, before.parameters[0].lower);
  EXPECT_TRUE(before.searched);
  const Chain chain = ur_like().chain;
  const Effect gain = make_effect(after, chain, 0);
  EXPECT_EQ(effect_parameters(after, chain, gain)[0].upper, 1.0);
  EXPECT_EQ(effect_parameters(chain, gain)[0].upper, before.parameters[0].upper);
}

void expect_refused_catalogue(const std::string& text, const std::string& place, const std::string& part) {
  try {
    parse_catalogue("effects:\n" + text, "own.yaml");
    ADD_FAILURE() << text << " was accepted";
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with("own.yaml:" + place)) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
  }
}

TEST(Catalogue, MistakesNameLineAndKey) {
  expect_refused_catalogue("  - {type: joint_gian}\n", "2: effects[0]", "no effect; known: joint_compliance");
  expect_refused_catalogue("  - type: joint_gain\n    serch: true\n", "3: effects[0]", "unknown key \"serch\"");
  expect_refused_catalogue("  - type: joint_gain\n    search: perhaps\n", "3: effects[0]", "must be true or false");
  expect_refused_catalogue("  - type: joint_gain\n    parameters: {gian: {scale: 1}}\n", "3: effects[0].parameters",
                           "unknown key \"gian\"; known: gain");
  expect_refused_catalogue("  - type: joint_gain\n    parameters:\n      gain: {scale: 0}\n",
                           "4: effects[0].parameters.gain", "\"scale\" is 0, must be > 0");
  expect_refused_catalogue("  - type: joint_gain\n    parameters:\n      gain: {lower: 5}\n",
                           "4: effects[0].parameters.gain", "must not be above");
  expect_refused_catalogue("  - {formula: joint_gain, place: robot}\n", "2: effects[0]", "the name of another effect");
  const std::string own = "  - formula: own\n    place: joint\n    terms:\n      - ";
  expect_refused_catalogue(own + "{joint: \"sin(q{}\", lower: 0, upper: 1}\n", "5: effects[0].terms[0]",
                           "of \"sin(q99\": ");
  expect_refused_catalogue(own + "{joint: \"q{} = 1\", lower: 0, upper: 1}\n", "5: effects[0].terms[0]",
                           "== compares; = is not allowed");
  expect_refused_catalogue(own + "{joint: \"q{}\", lower: 0}\n", "5: effects[0].terms[0]", "\"upper\" is missing");
  expect_refused_catalogue("  - {formula: own, place: robot, terms: [{joint: q1, lower: 0, upper: 1}]}\n",
                           "2: effects[0]", "acts on a joint");
  EXPECT_THROW(read_catalogue("/does/not/exist.yaml"), std::runtime_error);
}

}  // namespace
}  // namespace llmt::robotics
