// Tables and measurements that are refused, with the words that say why.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "llmt/robotics/measurements.hpp"
#include "oracles/thrown.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

Robot one_joint() { return make_robot(Convention::dh, {{0, 300, 0, 0}}); }

std::string refusal_of_table(const std::string& text) {
  return oracle::thrown<std::runtime_error>([&] { parse_measurements(text, "m.csv", one_joint()); });
}

TEST(RefusedMeasurements, NamesOfSessionsAndTargets) {
  for (const std::string kind : {"socket ", "plane ", "sphere ", "known sphere "}) {
    EXPECT_EQ(
        refusal_of_table("q1_deg,x_mm,session\n1,2,monday\n1,2," + kind + "a\n"),
        "m.csv:3: column \"session\": a session's name does not begin with \"socket \", \"plane \", \"sphere \" or "
        "\"known sphere \"")
        << kind;
  }
  for (const std::string column : {"session", "target"}) {
    const std::string header = "q1_deg,x_mm," + column + "\n1,2,a\n1,2,";
    EXPECT_EQ(refusal_of_table(header + std::string(200, 'n') + "\n"), "nothing was thrown");
    EXPECT_EQ(refusal_of_table(header + std::string(201, 'n') + "\n"),
              "m.csv:3: column \"" + column + "\": a name has at most 200 characters");
  }
}

TEST(RefusedMeasurements, PointsOnFeaturesBesideOtherReadings) {
  const std::string alone = " have no other readings beside them: fit them one after the other";
  EXPECT_EQ(refusal_of_table("q1_deg,plane\n1,a\n"), "nothing was thrown");
  EXPECT_EQ(refusal_of_table("q1_deg,sphere\n1,a\n"), "nothing was thrown");
  EXPECT_EQ(refusal_of_table("q1_deg,plane,socket\n1,a,b\n"), "m.csv:1: points on planes" + alone);
  EXPECT_EQ(refusal_of_table("q1_deg,plane,sphere\n1,a,b\n"), "m.csv:1: points on planes" + alone);
  EXPECT_EQ(refusal_of_table("q1_deg,sphere,x_mm\n1,a,2\n"), "m.csv:1: points on spheres" + alone);
  EXPECT_EQ(refusal_of_table("q1_deg,sphere,distance_mm\n1,a,2\n"), "m.csv:1: points on spheres" + alone);
}

TEST(RefusedMeasurements, MadeByAProgramWithSizesThatDiffer) {
  const Measurements sound = parse_measurements("q1_deg,x_mm,payload_kg\n1,2,0\n3,4,1\n", "m.csv", one_joint());
  const auto refusal_with = [&](const auto& change) {
    Measurements changed = sound;
    change(changed);
    return oracle::thrown<std::invalid_argument>([&] { to_csv(changed, one_joint()); });
  };
  const std::string who = "llmt::robotics::Measurements: ";
  EXPECT_EQ(refusal_with([](Measurements&) {}), "nothing was thrown");
  EXPECT_EQ(refusal_with([](Measurements& m) { m.poses.joints.resize(2, 2); }),
            who + "there are 2 joints, robot \"arm\" has 1");
  EXPECT_EQ(refusal_with([](Measurements& m) { m.positions_mm.conservativeResize(1, 3); }),
            who + "positions_mm is 1 x 3, must be 2 x 3");
  EXPECT_EQ(refusal_with([](Measurements& m) {
              m.measured = {false, false, false};
            }),
            who + "no coordinate was measured");
  EXPECT_EQ(refusal_with([](Measurements& m) { m.poses.observations.resize(1); }),
            who + "there are 1 observations of 2 rows");
  EXPECT_EQ(refusal_with([](Measurements& m) { m.poses.covariates["payload_kg"].conservativeResize(1); }),
            who + "column payload_kg has 1 values, must be 2");
  EXPECT_EQ(refusal_with([](Measurements& m) { m.poses.covariates["payload_kg"](0) = -0.5; }),
            who + "column payload_kg has -0.5, must not be negative");
  const double no_number = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal_with([&](Measurements& m) { m.poses.covariates["payload_kg"](1) = no_number; }),
            who + "column payload_kg has a value that is not finite");
  EXPECT_EQ(refusal_with([&](Measurements& m) { m.poses.joints(1, 0) = no_number; }),
            who + "a joint value is not finite");
  EXPECT_EQ(refusal_with([&](Measurements& m) { m.positions_mm(1, 0) = no_number; }), who + "a position is not finite");
}

}  // namespace
}  // namespace llmt::robotics
