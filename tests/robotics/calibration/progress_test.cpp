// Progress and cancellation of the calls that calibrate.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "watched.hpp"

namespace llmt::robotics {
namespace {

std::vector<std::string> steps_of(const std::vector<ProgressReport>& reports) {
  std::vector<std::string> steps;
  for (const ProgressReport& report : reports) {
    if (steps.empty() || steps.back() != report.step) steps.push_back(report.step);
  }
  return steps;
}

Robot planar() { return read_robot(LLMT_ROBOTS_DIR "/planar_two_link.yaml"); }

Measurements in_plane(Measurements measurements) {
  measurements.measured = {true, true, false};
  measurements.positions_mm.col(2).setZero();
  return measurements;
}

TEST(Progress, OfACalibrationReportNamesTheFolds) {
  const Robot robot = planar();
  const Measurements measured = in_plane(simulate(robot, {.poses = 40, .noise_um = 10.0, .seed = 1}));
  const watched::Call call = [&](const Progress& progress) {
    ReportOptions options{.correct = true, .folds = 2, .correction_folds = 2, .max_threads = 1};
    options.correction.max_leaves = 2;
    options.progress = progress;
    const CalibrationReport report = report_calibration(robot, measured, options);
    return fmt::format("{} {}", to_yaml(report.calibration.robot), report.decision);
  };
  const std::vector<ProgressReport> reports = watched::reports_of(call);
  watched::expect_rising(reports);
  EXPECT_EQ(steps_of(reports), (std::vector<std::string>{"all poses", "fold 1", "fold 2"}));
  watched::expect_stops_at_every_report(call, 11);
}

TEST(Progress, OfADiscoveryNamesTheSteps) {
  const Robot flexible = planar();
  Robot rigid = flexible;
  rigid.effects.clear();
  const Measurements measured = in_plane(simulate(flexible, {.poses = 30, .noise_um = 10.0, .seed = 1}));
  const watched::Call call = [&](const Progress& progress) {
    DiscoveryOptions options;
    options.progress = progress;
    return to_yaml(discover(rigid, measured, {}, options).improved.robot);
  };
  const std::vector<ProgressReport> reports = watched::reports_of(call);
  watched::expect_rising(reports);
  const std::vector<std::string> steps = steps_of(reports);
  ASSERT_GE(steps.size(), 3U);
  EXPECT_EQ(std::vector<std::string>(steps.begin(), steps.begin() + 3),
            (std::vector<std::string>{"calibrating", "searching, round 1", "searching, round 2"}));
  watched::expect_stops_at_every_report(call);
}

}  // namespace
}  // namespace llmt::robotics
