// Mechanisms given by equations: configurations, branches, refusals.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "llmt/random.hpp"
#include "llmt/robotics/mechanism/mechanism_file.hpp"

namespace llmt::robotics {
namespace {

constexpr double to_rad = std::numbers::pi / 180.0;

Mechanism five_bar() { return read_mechanism(LLMT_ROBOTS_DIR "/../../docs/samples/five_bar.yaml"); }

// Two circles about the elbows of the sample's nominal five-bar; the tool is above the line between the elbows.
Eigen::Vector2d tool_of_five_bar(double q1_deg, double q2_deg) {
  const Eigen::Vector2d left(200.0 * std::cos(q1_deg * to_rad), 200.0 * std::sin(q1_deg * to_rad));
  const Eigen::Vector2d right(300.0 + 200.0 * std::cos(q2_deg * to_rad), 200.0 * std::sin(q2_deg * to_rad));
  const Eigen::Vector2d between = right - left;
  const double half = 0.5 * between.norm();
  const Eigen::Vector2d up = Eigen::Vector2d(-between.y(), between.x()).normalized();
  return left + 0.5 * between + std::sqrt(300.0 * 300.0 - half * half) * up;
}

// q1, q2, p1, p2, x, y
Eigen::MatrixXd drives(Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  Eigen::MatrixXd known = Eigen::MatrixXd::Constant(count, 6, NAN);
  for (Eigen::Index i = 0; i < count; ++i) known.row(i).head(2) << random.uniform(80, 150), random.uniform(30, 100);
  return known;
}

TEST(Mechanism, ForwardKinematicsOfAFiveBarIsTheIntersectionOfTwoCircles) {
  const Eigen::MatrixXd known = drives(200, 1);
  const Assembly assembly = assemble(five_bar(), known);
  int out_of_reach = 0;
  for (Eigen::Index i = 0; i < known.rows(); ++i) {
    const Eigen::Vector2d tool = tool_of_five_bar(known(i, 0), known(i, 1));
    ASSERT_EQ(assembly.failures[i].empty(), tool.allFinite()) << i;  // the couplers reach 600 mm, the elbows may not
    if (!tool.allFinite()) {
      ++out_of_reach;
    } else {
      EXPECT_LT((assembly.coordinates.row(i).tail(2).transpose() - tool).norm(), 1e-8) << i;
    }
  }
  EXPECT_GT(out_of_reach, 0);
  EXPECT_LT(out_of_reach, 40);
}

TEST(Mechanism, WhatIsKnownDecidesWhatIsSolvedFor) {
  const Assembly forward = assemble(five_bar(), drives(50, 2));
  Eigen::MatrixXd known = forward.coordinates;
  known.leftCols(4).setConstant(NAN);  // the tool alone: inverse kinematics
  const Assembly inverse = assemble(five_bar(), known);
  for (Eigen::Index i = 0; i < known.rows(); ++i) {
    if (!forward.failures[i].empty()) continue;
    EXPECT_LT((inverse.coordinates - forward.coordinates).row(i).cwiseAbs().maxCoeff(), 1e-7) << i;
  }
}

TEST(Mechanism, ReadingsTooManyAreAdjustedByTheLeastThatMeetsAllEquations) {
  Mechanism line{.name = "equal",
                 .parameters = {},
                 .coordinates = {{.name = "a", .unit = "1", .sigma = 1.0}, {.name = "b", .unit = "1", .sigma = 2.0}},
                 .definitions = {},
                 .equations = {"a = b"}};
  const Assembly assembly = assemble(line, Eigen::RowVector2d(1.0, 2.0));
  const double mean = (1.0 / 1.0 + 2.0 / 4.0) / (1.0 / 1.0 + 1.0 / 4.0);  // weights 1/sigma^2
  EXPECT_NEAR(assembly.coordinates(0, 0), mean, 1e-12);
  EXPECT_NEAR(assembly.coordinates(0, 1), mean, 1e-12);
}

TEST(Mechanism, APoseBehindASingularityFailsWithItsReason) {
  Eigen::MatrixXd known = Eigen::MatrixXd::Constant(3, 6, NAN);
  known.row(0).head(2) << 100.0, 80.0;
  known.row(1).tail(2) << 150.0, 600.0;  // out of reach
  known.row(2).head(2) << 101.0, 79.0;
  const Assembly assembly = assemble(five_bar(), known);
  EXPECT_EQ(assembly.failures[0], "");
  EXPECT_NE(assembly.failures[1], "");
  EXPECT_EQ(assembly.failures[2], "");
  EXPECT_TRUE(assembly.coordinates.row(1).array().isNaN().all());
}

// The elbows pass from one side to the other only through the stretched arm; a straight line there does not exist.
TEST(Mechanism, TheBranchIsThatOfTheStartValues) {
  Mechanism below = five_bar();
  below.coordinates[5].start = -100.0;
  below.coordinates[2].start = 120.0 + 60.0;
  below.coordinates[3].start = -120.0 - 60.0;
  const Assembly assembly = assemble(below, drives(50, 3));
  for (Eigen::Index i = 0; i < 50; ++i) {
    if (!assembly.failures[i].empty()) continue;
    const Eigen::MatrixXd known = drives(50, 3);
    const Eigen::Vector2d above = tool_of_five_bar(known(i, 0), known(i, 1));
    EXPECT_GT((assembly.coordinates.row(i).tail(2).transpose() - above).norm(), 1.0) << i;
  }
}

// A slider-crank whose crank goes round: x = r cos q + sqrt(l^2 - r^2 sin^2 q) in closed form.
TEST(Mechanism, AnglesGoTheShortWayRound) {
  const Mechanism slider{.name = "slider",
                         .parameters = {{.name = "r", .value = 50.0}, {.name = "l", .value = 120.0}},
                         .coordinates = {{.name = "q"}, {.name = "c"}, {.name = "x", .unit = "mm", .start = 170.0}},
                         .definitions = {},
                         .equations = {"r*cos(q) + l*cos(c) = x", "r*sin(q) + l*sin(c) = 0"}};
  const Eigen::Vector4d angles(359.0, -7201.0, 90.0, 36000.0);
  Eigen::MatrixXd known = Eigen::MatrixXd::Constant(4, 3, NAN);
  known.col(0) = angles;
  const Assembly assembly = assemble(slider, known);
  for (Eigen::Index i = 0; i < 4; ++i) {
    const double q = angles(i) * to_rad;
    EXPECT_EQ(assembly.coordinates(i, 0), angles(i));
    EXPECT_NEAR(assembly.coordinates(i, 1), -std::asin(50.0 / 120.0 * std::sin(q)) / to_rad, 1e-8);
    EXPECT_NEAR(assembly.coordinates(i, 2), 50.0 * std::cos(q) + std::sqrt(14400.0 - std::pow(50.0 * std::sin(q), 2)),
                1e-8);
  }
}

TEST(Mechanism, TheAngleOfALeadscrewKeepsItsTurns) {
  const Mechanism screw{.name = "screw",
                        .parameters = {{.name = "pitch", .value = 5.0}},
                        .coordinates = {{.name = "q"}, {.name = "x", .unit = "mm"}},
                        .definitions = {},
                        .equations = {"x = pitch*q/(2*pi) + 0.1*sin(q)"}};
  const Assembly assembly = assemble(screw, (Eigen::MatrixXd(2, 2) << 3600.0, NAN, NAN, 10.0).finished());
  EXPECT_NEAR(assembly.coordinates(0, 1), 50.0, 1e-8);
  EXPECT_NEAR(assembly.coordinates(1, 0), 720.0, 1e-7);
}

void expect_refused(Mechanism mechanism, const std::string& words) {
  try {
    validate(mechanism);
    ADD_FAILURE() << "accepted, expected: " << words;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

TEST(Mechanism, MistakesAreRefusedByName) {
  const auto changed = [](const auto& change) {
    Mechanism mechanism = five_bar();
    change(mechanism);
    return mechanism;
  };
  expect_refused(changed([](Mechanism& m) { m.parameters[1].name = "base"; }), "\"base\" is there twice");
  expect_refused(changed([](Mechanism& m) { m.parameters[1].name = "sin"; }), "a word of the expressions");
  expect_refused(changed([](Mechanism& m) { m.parameters[1].name = "2x"; }), "is no name");
  expect_refused(changed([](Mechanism& m) { m.equations[2] = "x1 = x3"; }),
                 "equation 3, right of =: x3 is no parameter");
  expect_refused(changed([](Mechanism& m) { m.equations[0] = "x1 = = x2"; }), "equation 1, right of =: ");
  expect_refused(changed([](Mechanism& m) { m.equations[0] = "x1 = x2 = x"; }), "equation 1, right of =: ");
  expect_refused(changed([](Mechanism& m) { m.equations[0] = "x1 = x2 +* 3"; }),
                 "equation 1, right of =: column 6 of \" x2 +* 3\"");
  expect_refused(changed([](Mechanism& m) { m.parameters.push_back({.name = "idle"}); }), "idle occurs in no equation");
  expect_refused(changed([](Mechanism& m) { m.coordinates.push_back({.name = "idle"}); }),
                 "idle occurs in no equation");
  expect_refused(changed([](Mechanism& m) { m.definitions[0].text = "x2 + 1"; }),
                 "definition of x1: x2 is no parameter");
  expect_refused(changed([](Mechanism& m) { m.parameters[0].unit = "m"; }), "must be mm, deg or 1");
  expect_refused(changed([](Mechanism& m) { m.parameters[0].value = NAN; }), "must be finite");
  expect_refused(changed([](Mechanism& m) { m.parameters[0].prior_sigma = 0.0; }), "must be > 0");
  expect_refused(changed([](Mechanism& m) { m.coordinates[0].sigma = -1.0; }), "must be >= 0");
  expect_refused(changed([](Mechanism& m) { m.coordinates[0].upper = 10.0; }), "above the lower one");
  expect_refused(changed([](Mechanism& m) { m.equations.clear(); }), "no equations");
}

TEST(Mechanism, EquationsMayCompare) {
  Mechanism sign{.name = "sign",
                 .parameters = {},
                 .coordinates = {{.name = "a", .unit = "1"}, {.name = "b", .unit = "1"}},
                 .definitions = {},
                 .equations = {"b = (a >= 0 ? 2*a : a)"}};
  const Assembly assembly = assemble(sign, (Eigen::MatrixXd(2, 2) << 3.0, NAN, -3.0, NAN).finished());
  EXPECT_NEAR(assembly.coordinates(0, 1), 6.0, 1e-9);
  EXPECT_NEAR(assembly.coordinates(1, 1), -3.0, 1e-9);
}

TEST(MechanismFile, WhatIsWrittenIsReadToTheLastBit) {
  Mechanism mechanism = five_bar();
  mechanism.parameters[0].value = 1.0 / 3.0;
  mechanism.parameters[0].standard_error = 0.1;
  mechanism.parameters[1].prior_sigma = 0.7;
  mechanism.parameters[2].fixed = true;
  mechanism.parameters.push_back({.name = "gain", .unit = "1", .value = 1.1});
  mechanism.equations[0] = "gain*(fx + cos(turn)*x1 - sin(turn)*y1) = x";
  mechanism.coordinates[0].sigma = 0.1;
  const Mechanism read = parse_mechanism(to_yaml(mechanism), "copy");
  EXPECT_EQ(to_yaml(read), to_yaml(mechanism));
  EXPECT_EQ(read.parameters[0].value, 1.0 / 3.0);
  EXPECT_EQ(read.parameters[0].standard_error, 0.1);
  EXPECT_EQ(read.parameters[1].prior_sigma, 0.7);
  EXPECT_TRUE(read.parameters[2].fixed);
  EXPECT_EQ(read.parameters.back().unit, "1");
  EXPECT_EQ(read.coordinates[0].lower, 80.0);
  EXPECT_FALSE(read.coordinates[2].has_limits());
  EXPECT_EQ(read.equations, mechanism.equations);
}

void expect_file_refused(const std::string& text, const std::string& words) {
  try {
    parse_mechanism(text, "m.yaml");
    ADD_FAILURE() << "accepted, expected: " << words;
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

TEST(MechanismFile, WhatIsLargeIsRefused) {
  const auto refusal = [](const std::string& more) {
    try {
      parse_mechanism("mechanism: m\njoints: [{name: q, start_deg: 60}]\nequations: [q = 1]\n" + more, "m.yaml");
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  std::string definitions = "definitions:\n";
  std::string outputs = "outputs:\n";
  for (int i = 0; i < 1001; ++i) definitions += "  d" + std::to_string(i) + ": q\n";
  for (int i = 0; i < 101; ++i) outputs += "  - {name: x" + std::to_string(i) + ", start_mm: 1}\n";
  EXPECT_EQ(refusal(definitions), "m.yaml:5: there are 1001 definitions, at most 1000 are possible");
  EXPECT_NE(refusal(outputs).find("100"), std::string::npos) << refusal(outputs);
}

TEST(MechanismFile, MistakesAreRefusedWithTheirLine) {
  expect_file_refused("joints: []\n", "m.yaml:1: key \"mechanism\" is missing");
  const std::string begin = "mechanism: m\njoints:\n";
  expect_file_refused(begin + "  - {name: q}\nequations: [q]\n", "m.yaml:3: joints[0]: one of the keys start_mm");
  expect_file_refused(begin + "  - {name: q, start_deg: 0, sigma_mm: 1}\nequations: [q]\n", "unknown key \"sigma_mm\"");
  expect_file_refused(begin + "  - {name: q, start_deg: 0, start_mm: 1}\nequations: [q]\n", "in two units");
  expect_file_refused(begin + "  - {name: q, start_deg: 0}\nequations: q\n", "must be a list of texts");
  expect_file_refused(begin + "  - {name: q, start_deg: 0}\nequations: [q + r]\n", "m.yaml: ");
  expect_file_refused(begin + "  - {name: q, start_deg: 0}\n", "key \"equations\" is missing");
}

}  // namespace
}  // namespace llmt::robotics
