// Reports of the robot layer: what the documents say of simulated arms, where the truth is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "report/document/document_text.hpp"
#include "report/robot/arms.hpp"
#include "report/robot/calibration_document.hpp"
#include "report/robot/calibration_run.hpp"
#include "report/robot/discovery/discovery_page.hpp"
#include "report/robot/discovery/of_discovery.hpp"
#include "report/robot/of_calibration.hpp"

namespace {

using namespace llmt::report;
namespace rb = llmt::robotics;

rb::Robot planar(bool flexible) {
  rb::Robot robot = rb::read_robot(LLMT_ROBOTS "/planar_two_link.yaml");
  if (!flexible) robot.effects.clear();
  return robot;
}

rb::Measurements measured(const rb::Robot& robot, Eigen::Index poses = 200) {
  return rb::simulate(robot, {.poses = poses, .noise_um = 10.0, .seed = 3});
}

int blocks_of_kind(const Json& document, const std::string& kind) {
  int count = 0;
  for (const Json& section : document["sections"]) {
    for (const Json& each : section["blocks"]) count += each["kind"] == kind;
  }
  return count;
}

TEST(RobotReport, CalibrationSaysWhatItGainedOnPosesLeftOut) {
  const rb::Robot nominal = planar(false);
  rb::Robot truth = nominal;
  truth.chain.joints[1].a_mm += 2.0;
  const rb::Measurements data = measured(truth, 60);
  const CalibrationRun run = run_calibration(
      nominal, data, {},
      {.robot_file = "a/arm.yaml", .data_file = "b/data.csv", .test_file = "", .quality = true, .page = true});
  const Document page = calibration_page(run);
  EXPECT_EQ(page.title, "llmt-robot calibrate arm.yaml data.csv");
  EXPECT_TRUE(page.answer.starts_with("Calibrated: the mean position error falls from")) << page.answer;
  EXPECT_TRUE(page.answer.ends_with("on poses left out of the fit.")) << page.answer;
  const Json written = to_json(page);
  EXPECT_EQ(blocks_of_kind(written, "arm"), 2);
  EXPECT_EQ(blocks_of_kind(written, "map"), 2);  // coverage and correlations
  // A terminal shows the same words and tables, and the learning curve as numbers.
  const std::string text = document_text(calibration_document(run));
  Document with_folder = page;  // a page goes to others, whom the folder does not concern
  EXPECT_TRUE(page.subject.starts_with("data.csv: ")) << page.subject;
  with_folder.subject = "b/" + page.subject;
  EXPECT_EQ(document_text(with_folder), text);
  EXPECT_TRUE(text.starts_with("b/data.csv: 60 poses of " + nominal.chain.name + "\n" + page.answer + "\n")) << text;
  const Json curve = calibration_json(run, "")["quality"]["learning_curve"];
  ASSERT_FALSE(curve.empty());
  int charts = 0;
  for (const Json& section : written["sections"]) {
    for (const Json& each : section["blocks"]) {
      if (!each.contains("in_words")) continue;
      ++charts;
      EXPECT_EQ(each["layers"][0]["x"].size(), curve.size());
      EXPECT_NEAR(each["layers"][0]["y"][0].get<double>(), curve[0]["held_out_mm"].get<double>(), 1e-5);
    }
  }
  EXPECT_EQ(charts, 1);
}

TEST(RobotReport, DiscoveryNamesTheEffectAndShowsItsShape) {
  const rb::Robot nominal = planar(false);
  const rb::Measurements data = measured(planar(true));
  const rb::Discovery found = rb::discover(nominal, data);
  const Document document = discovery_report({"arm.yaml", "data.csv", data, found, {}});
  EXPECT_TRUE(document.answer.starts_with("The model lacks: link bending")) << document.answer;
  ASSERT_EQ(document.beside_main.size(), 1);
  EXPECT_EQ(document.beside_main.front()["layers"].size(), 2);
}

TEST(RobotReport, NothingMissingIsSaidWithTheNoise) {
  const rb::Robot nominal = planar(false);
  const rb::Measurements data = measured(nominal, 100);
  const rb::Discovery found = rb::discover(nominal, data);
  const Document document = discovery_report({"arm.yaml", "data.csv", data, found, {}});
  EXPECT_TRUE(document.answer.starts_with("Nothing is missing")) << document.answer;
}

TEST(RobotReport, ErrorsOfCoordinatesThatWereNotMeasuredAreZero) {
  rb::Measurements data;
  data.positions_mm = Eigen::MatrixXd::Zero(2, 3);
  data.measured = {true, false, true};
  const Eigen::MatrixXd errors = errors_at(Eigen::MatrixXd::Ones(2, 3), data);
  EXPECT_EQ(errors, (Eigen::MatrixXd(2, 3) << -1, 0, -1, -1, 0, -1).finished());
}

TEST(RobotReport, CoverageCountsEveryPoseOnce) {
  const rb::Robot robot = planar(false);
  const rb::Measurements data = measured(robot, 50);
  const Map map = coverage(robot.chain, data.poses.joints);
  for (Eigen::Index j = 0; j < map.z.rows(); ++j) EXPECT_NEAR(map.z.row(j).sum(), 100.0, 1e-9);
}

// On a terminal of 80 columns lines are full, and none is broken a second time.
TEST(RobotReport, ThePageIsWrappedOnceToItsWidth) {
  const rb::Discovery found = rb::discover(planar(false), measured(planar(true)));
  for (const std::size_t width : {60U, 80U, 100U, 300U}) {
    const std::string page = discovery_page(found, {}, width);
    const std::size_t most = std::min<std::size_t>(width, 100);
    std::vector<std::string> lines;
    std::istringstream text(page.substr(0, page.find("\nDetails")));
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    for (std::size_t k = 0; k < lines.size(); ++k) {
      EXPECT_LE(columns_of(lines[k]), most) << page;
      if (k + 1 == lines.size() || !lines[k + 1].starts_with("    ")) continue;
      const std::string next = lines[k + 1].substr(lines[k + 1].find_first_not_of(' '));
      EXPECT_GT(columns_of(lines[k]) + 1 + next.find(' '), most) << page;
    }
  }
}

// The last cells of the table of answers in docs/discovery.md, without their backticks.
std::set<std::string> documented_beginnings() {
  std::ifstream page(LLMT_ROOT "/docs/discovery.md");
  std::set<std::string> beginnings;
  bool is_inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) is_inside = line == "## The answer";
    const std::size_t begin = line.rfind("| `");
    if (!is_inside || begin == 0 || begin == std::string::npos || !line.ends_with("` |")) continue;
    beginnings.insert(line.substr(begin + 3, line.size() - begin - 6));
  }
  return beginnings;
}

TEST(RobotReport, ThePageBeginsAsTheTableOfAnswersSays) {
  const std::set<std::string> beginnings = documented_beginnings();
  std::set<std::string> seen;
  for (int number = 0; number <= static_cast<int>(rb::Headline::unknown); ++number) {
    rb::Discovery found;
    found.headline = static_cast<rb::Headline>(number);
    const std::string page = discovery_page(found, {});
    for (const std::string& beginning : beginnings) {
      if (!page.starts_with(beginning)) continue;
      EXPECT_TRUE(seen.insert(beginning).second) << beginning;
    }
    EXPECT_EQ(static_cast<int>(seen.size()), number + 1) << page;
  }
  EXPECT_EQ(seen, beginnings);
}

}  // namespace
