#include <fmt/format.h>
#include <gtest/gtest.h>

#include "llmt/robotics/measurements.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {
namespace {

// Two joints, the second prismatic.
Robot waist_and_slide() {
  Robot robot = make_robot(Convention::dh, {{90, 0, 100, 0}, {0, 0, 0, 0}});
  robot.chain.joints[1].type = JointType::prismatic;
  robot.chain.joints[0].name = "waist";
  return robot;
}

Measurements read(const std::string& text, const ColumnMap& map = {}, const Robot& robot = waist_and_slide()) {
  return parse_measurements(text, "m.csv", robot, {}, DecimalMark::point, map);
}

void expect_refused(const std::string& text, const std::string& place, const std::string& part,
                    const ColumnMap& map = {}) {
  try {
    read(text, map);
    ADD_FAILURE() << "no error: " << text;
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with(place)) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
  }
}

TEST(ObservationFile, EveryTargetOfAPoseIsAReadingAndSomeMayBeMissing) {
  const Measurements m = read(
      "q1_deg,q2_mm,t1_x_mm,t1_y_mm,t1_z_mm,t2_x_mm,t2_y_mm,t2_z_mm,payload_kg\n"
      "1,2,3,4,5,6,7,8,0.5\n"
      "2,3,,,,7,8,9,0.6\n"
      "3,4,5,6,7,0,0,0,0.7\n");
  ASSERT_EQ(m.count(), 4);
  EXPECT_EQ(m.positions_mm.row(1), Eigen::RowVector3d(6.0, 7.0, 8.0));
  EXPECT_EQ(m.positions_mm.row(2), Eigen::RowVector3d(7.0, 8.0, 9.0));
  EXPECT_EQ(m.poses.observations[0].tool, "");
  EXPECT_EQ(m.poses.observations[1].tool, "t2");
  EXPECT_EQ(m.poses.covariates.at("payload_kg")(2), 0.6);
  EXPECT_EQ(pose_labels(m.poses), (std::vector<double>{0.0, 0.0, 1.0, 2.0}));
  ASSERT_EQ(m.warnings.size(), 1u);
  EXPECT_NE(m.warnings[0].words({}).find("line 4"), std::string::npos) << m.warnings[0].words({});
}

TEST(ObservationFile, LongFormatAndSessionsNameTheirFrames) {
  const Measurements m = read(
      "q1_deg,q2_mm,x_mm,y_mm,z_mm,target,session\n"
      "1,2,3,4,5,ball,monday\n"
      "1,2,6,7,8,nest 2,monday\n"
      "4,5,6,7,8,ball,tue.am\n"
      "4,5,6,7,9,nest 2,tue.am\n");
  const std::vector<Observation>& seen = m.poses.observations;
  ASSERT_EQ(seen.size(), 4u);
  EXPECT_EQ(seen[0].base, "");
  EXPECT_EQ(seen[0].tool, "");
  EXPECT_EQ(seen[1].tool, "nest 2");
  EXPECT_EQ(seen[2].base, "tue_am");
  EXPECT_EQ(seen[2].tool, "tue_am/ball");
  EXPECT_EQ(seen[3].tool, "tue_am/nest 2");
  EXPECT_EQ(seen[0].stand, seen[1].stand);
  EXPECT_NE(seen[1].stand, seen[2].stand);
  EXPECT_EQ(seen[2].stand, seen[3].stand);
  const Robot robot = with_frames(waist_and_slide(), m.poses);
  EXPECT_EQ(robot.chain.bases.size(), 1u);
  EXPECT_EQ(robot.chain.tools.size(), 3u);
}

// A robot that was calibrated with such a file knows its frames by their names.
TEST(ObservationFile, FramesThatTheRobotHasAreFoundAgain) {
  Robot robot = waist_and_slide();
  robot.chain.tools = {{"t2", {}}};
  const Measurements m = read("q1_deg,q2_mm,x_mm,target\n1,2,3,t2\n2,3,4,t1\n", {}, robot);
  EXPECT_EQ(m.poses.observations[0].tool, "t2");
  EXPECT_EQ(m.poses.observations[1].tool, "");
}

TEST(ObservationFile, DistancesAreReadings) {
  const Measurements m = read("q1_deg,q2_mm,distance_m\n1,2,0.5\n");
  EXPECT_EQ(m.positions_mm(0, 0), 500.0);
  EXPECT_EQ(m.poses.observations[0].reading, Reading::distance);
  EXPECT_FALSE(m.measured[1]);
  expect_refused("q1_deg,q2_mm,distance_mm\n1,2,-3\n", "m.csv:2:", "above 0");
  expect_refused("q1_deg,q2_mm,distance_mm,x_mm\n1,2,3,4\n", "m.csv:1:", "one after the other");
}

TEST(ObservationFile, ColumnMapNamesColumnsAndUnits) {
  const ColumnMap map = parse_column_map("decimal: comma\ncolumns: {Axis 1: waist_deg, A2: q2_mm, X: x_m}\n", "map");
  const Measurements m =
      parse_measurements("Axis 1;A2;X\n180,0;2,5;0,25\n", "m.csv", waist_and_slide(), {}, DecimalMark::point, map);
  EXPECT_DOUBLE_EQ(m.poses.joints(0, 0), std::numbers::pi);
  EXPECT_EQ(m.poses.joints(0, 1), 2.5);
  EXPECT_EQ(m.positions_mm(0, 0), 250.0);
  EXPECT_TRUE(m.unused_columns.empty());
  expect_refused("q1_deg,q2_mm,x_mm\n1,2,3\n", "m.csv:1:", "no column \"A2\", which the column map calls q2_mm", map);
  expect_refused("a,q2_mm,x_mm\n1,2,3\n", "m.csv:1:", "no column that has a meaning",
                 parse_column_map("columns: {a: quark_deg}\n", "map"));
  const auto message = [](const std::string& text) {
    try {
      parse_column_map(text, "map");
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(message("orientation: xyz\ncolumns: {}\n").starts_with("map:1:"));
  EXPECT_TRUE(message("decimal: dot\ncolumns: {}\n").starts_with("map:1:"));
  EXPECT_TRUE(message("columns: {}\nseparator: x\n").starts_with("map:"));
}

TEST(ObservationFile, StatedUncertaintiesBecomeStandardDeviations) {
  const Measurements m = read("q1_deg,q2_mm,x_mm,y_mm,z_mm,U95_um,sigma_z_um\n1,2,3,4,5,30,8\n");
  EXPECT_TRUE(stated_sigma_mm(m).isApprox(Eigen::RowVector3d(0.015, 0.015, 0.008)));
  expect_refused("q1_deg,q2_mm,x_mm,sigma_x_um\n1,2,3,4\n2,3,4,0\n", "m.csv:3:", "standard deviation must be above 0");
  expect_refused("q1_deg,q2_mm,x_mm,sigma_x_um\n1,2,3,nan\n", "m.csv:2:", "sigma_x_um");
  expect_refused("q1_deg,q2_mm,x_mm,sigma_x_um,U95_x_um\n1,2,3,4,5\n", "m.csv:1:", "both state the noise");
}

TEST(ObservationFile, ColumnsThatLookMeantAreNamedOnce) {
  const Measurements m = read("q1_deg,q2_mm,x_mm,SMR_ID,torque_1,torque_2,Temperature\n1,2,3,a,1,2,20\n");
  ASSERT_EQ(m.warnings.size(), 3u);
  EXPECT_NE(m.warnings[0].words({}).find("\"SMR_ID\""), std::string::npos) << m.warnings[0].words({});
  EXPECT_NE(m.warnings[0].words({}).find("name it target"), std::string::npos) << m.warnings[0].words({});
  EXPECT_EQ(m.unused_columns.size(), 4u);
}

TEST(ObservationFile, AnIncompleteOrientationAndATargetThatWasNeverSeenAreSaid) {
  const Measurements partial = read("q1_deg,q2_mm,x_mm,qw,qx,qy\n1,2,3,1,0,0\n");
  ASSERT_EQ(partial.warnings.size(), 1u);
  EXPECT_NE(partial.warnings[0].words({}).find("there is no column qz"), std::string::npos)
      << partial.warnings[0].words({});
  const Measurements unseen = read("q1_deg,q2_mm,t1_x_mm,t2_x_mm\n1,2,3,\n2,3,4,\n");
  ASSERT_EQ(unseen.warnings.size(), 1u);
  EXPECT_NE(unseen.warnings[0].words({}).find("target t2 was never seen"), std::string::npos)
      << unseen.warnings[0].words({});
}

// A long table may be sorted by target.
TEST(ObservationFile, RowsOfOnePoseNeedNotFollowEachOther) {
  const std::string header = "q1_deg,q2_mm,x_mm,target";
  const Measurements sorted = read(header + "\n1,2,3,a\n2,3,4,a\n1,2,5,b\n2,3,6,b\n");
  const std::vector<Observation>& seen = sorted.poses.observations;
  EXPECT_EQ(seen[0].stand, seen[2].stand);
  EXPECT_EQ(seen[1].stand, seen[3].stand);
  EXPECT_NE(seen[0].stand, seen[1].stand);
  const Measurements timed = read(header + ",order\n1,2,3,a,1\n2,3,4,a,2\n1,2,5,b,3\n");
  EXPECT_NE(timed.poses.observations[0].stand, timed.poses.observations[2].stand);
}

TEST(ObservationFile, MistakesAreNamedWithTheirPlace) {
  expect_refused("q1_deg,q2_mm,x_mm,t1_x_mm\n1,2,3,4\n", "m.csv:1:", "name them all");
  expect_refused("q1_deg,q2_mm,t1_x_mm,t2_x_mm,t2_y_mm\n1,2,3,4,5\n", "m.csv:1:", "no column t1_y_mm");
  expect_refused("q1_deg,q2_mm,t1_x_mm,t1_y_mm\n1,2,3,4\n1,2,3,\n", "m.csv:3:", "t1_y is missing");
  expect_refused("q1_deg,q2_mm,x_mm,target\n1,2,3,a\n1,2,3,\n", "m.csv:3:", "the name is missing");
  expect_refused("q1_deg,q2_mm,x_mm,session\n1,2,3,\n", "m.csv:2:", "the name is missing");
  expect_refused("q1_deg,q2_mm,x_mm,y_mm,z_mm,qw,qx,qy,qz\n1,2,3,4,5,0,0,0,0\n", "m.csv:2:", "length 0");
}

TEST(ObservationFile, WritingAndReadingKeepsTargetsSessionsAndDistances) {
  for (const std::string text :
       {"q1_deg,q2_mm,t1_x_mm,t1_y_mm,t1_z_mm,t2_x_mm,t2_y_mm,t2_z_mm\n1,2,3,4,5,6,7,8\n2,3,,,,7,8,9\n",
        "q1_deg,q2_mm,x_mm,session\n1,2,3,a\n2,3,4,b\n", "q1_deg,q2_mm,distance_mm\n1,2,3\n"}) {
    const Measurements once = read(text);
    const Measurements again = read(to_csv(once, with_frames(waist_and_slide(), once.poses)));
    EXPECT_EQ(again.positions_mm, once.positions_mm);
    ASSERT_EQ(again.poses.observations.size(), once.poses.observations.size());
    for (std::size_t i = 0; i < once.poses.observations.size(); ++i) {
      EXPECT_EQ(again.poses.observations[i].base, once.poses.observations[i].base);
      EXPECT_EQ(again.poses.observations[i].tool, once.poses.observations[i].tool);
      EXPECT_EQ(again.poses.observations[i].stand, once.poses.observations[i].stand);
      EXPECT_EQ(again.poses.observations[i].reading, once.poses.observations[i].reading);
    }
  }
}

// The names of the robot's own frames are kept, so that a file of one other session or target is not taken for them.
TEST(ObservationFile, TheRobotsOwnFramesHaveNames) {
  const char* header = "q1_deg,q2_mm,x_mm,session,target\n";
  const Measurements m = read(std::string(header) + "1,2,3,mon,a\n1,2,4,mon,b\n2,3,4,tue,a\n");
  const Robot robot = with_frames(waist_and_slide(), m);
  EXPECT_EQ(robot.chain.session, "mon");
  EXPECT_EQ(robot.chain.target, "a");
  const Measurements later = read(std::string(header) + "1,2,3,tue,a\n1,2,4,mon,b\n2,3,4,wed,a\n", {}, robot);
  const std::vector<Observation>& seen = later.poses.observations;
  EXPECT_EQ(seen[0].base, "tue");
  EXPECT_EQ(seen[0].tool, "tue/a");
  EXPECT_EQ(seen[1].base, "");
  EXPECT_EQ(seen[1].tool, "b");
  EXPECT_EQ(seen[2].base, "wed");
  EXPECT_THROW(positions(robot, later.poses), std::invalid_argument);  // there is no wed
}

TEST(ObservationFile, AnotherSessionHasAnotherTool) {
  const Measurements m = read("q1_deg,q2_mm,x_mm,session\n1,2,3,mon\n2,3,4,tue\n");
  EXPECT_EQ(m.poses.observations[0].tool, "");
  EXPECT_EQ(m.poses.observations[1].tool, "tue");
  EXPECT_EQ(m.target, "");
  expect_refused("q1_deg,q2_mm,x_mm,session\n1,2,3,1.0\n2,3,4,1_0\n", "m.csv:3:", "differ only in a dot");
}

// A base has six values and its tool three: nine coordinates are three points, and say nothing more.
TEST(SmallSessions, AreLeftOutAndNamedWithTheirLines) {
  const Robot robot = make_robot(Convention::dh, {{0, 300, 0, 0}});
  const auto table = [](int of_small) {
    std::string text = "q1_rad,x_mm,y_mm,z_mm,session\n";
    for (int k = 0; k < 5; ++k) text += fmt::format("{},1,2,3,monday\n", k);
    for (int k = 0; k < of_small; ++k) text += fmt::format("{},1,2,3,tuesday\n", k);
    return text;
  };
  Measurements few = parse_measurements(table(3), "m.csv", robot);
  const Measurements left = without_small_sessions(few);
  EXPECT_EQ(left.count(), 5);
  ASSERT_EQ(left.warnings.size(), 1U);
  EXPECT_NE(left.warnings[0].words({}).find("1 of 2 sessions left out"), std::string::npos)
      << left.warnings[0].words({});
  EXPECT_NE(left.warnings[0].words({}).find("tuesday (lines 7, 8, 9)"), std::string::npos)
      << left.warnings[0].words({});
  few.lines.clear();  // made by a program
  EXPECT_NE(without_small_sessions(few).warnings[0].words({}).find("(rows 6, 7, 8)"), std::string::npos);
  const Measurements enough = parse_measurements(table(4), "m.csv", robot);
  EXPECT_EQ(without_small_sessions(enough).count(), 9);
  EXPECT_TRUE(without_small_sessions(enough).warnings.empty());
}

// A socket has three values, a plane three, a sphere four, and three of a known radius; all share the tool.
TEST(SmallSessions, AreJudgedByWhatThereIsToFindOfASocketAPlaneAndASphere) {
  const Robot robot = make_robot(Convention::dh, {{0, 300, 0, 0}});
  const struct {
    const char* column;
    const char* cell;
    int too_few;
  } cases[] = {{"socket", "", 1}, {"plane", "", 3}, {"sphere", "", 4}, {"sphere,radius_mm", ",20", 3}};
  for (const auto& one : cases) {
    const auto kept_of = [&](int of_small) {
      std::string text = fmt::format("q1_rad,{}\n", one.column);
      for (int k = 0; k < 20; ++k) text += fmt::format("{},large{}\n", k, one.cell);
      for (int k = 0; k < of_small; ++k) text += fmt::format("{},small{}\n", k, one.cell);
      return without_small_sessions(parse_measurements(text, "m.csv", robot));
    };
    const Measurements left = kept_of(one.too_few);
    EXPECT_EQ(left.count(), 20) << one.column;
    ASSERT_EQ(left.warnings.size(), 1U);
    EXPECT_NE(left.warnings[0].words({}).find("1 of 2 sessions, sockets, planes and spheres left out"),
              std::string::npos)
        << left.warnings[0].words({});
    EXPECT_NE(left.warnings[0].words({}).find("small (line"), std::string::npos) << left.warnings[0].words({});
    EXPECT_EQ(kept_of(one.too_few + 1).count(), 20 + one.too_few + 1) << one.column;
  }
}

}  // namespace
}  // namespace llmt::robotics
