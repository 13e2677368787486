/// \file
/// A calibration from what was read to what is reported.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/likely_mistake.hpp"
#include "report/robot/calibration_facts.hpp"

namespace llmt::report {

/// What is asked of a calibration. The names of files stand in messages.
struct CalibrationTask {
  std::string robot_file;
  std::string data_file;
  std::string test_file;
  bool robust = false;                ///< leave out readings that lie far off
  bool quality = false;               ///< with CalibrationDetails and the learning curve
  bool page = false;                  ///< with the learning curve
  bool new_session = false;           ///< base and tool are fitted to the test measurements
  std::string accept_suspicion = {};  ///< name of a suspicion that is none
  double limit_mm = 0.0;              ///< largest mean error to be accepted; 0: nobody asked
  robotics::ReportOptions options = {};
  Face face = {};
};

/// The answer to the question whether the error is within the limit. By the test file, or else by poses left out.
struct Acceptance {
  enum class Verdict { not_asked, pass, fail, not_evaluated };
  Verdict verdict = Verdict::not_asked;
  double error_mm = 0.0;  ///< mean of the robot to use
  std::string sentence;   ///< "PASS: the mean error on poses left out is 0.0330 mm, the limit 0.5 mm."
};

/// "pass", "fail", "not evaluated".
std::string to_string(Acceptance::Verdict verdict);

/// A calibration with all that its reports show.
struct CalibrationRun {
  CalibrationTask task;
  robotics::Robot nominal;              ///< as described, with frames for all that was measured
  robotics::Measurements measurements;  ///< that were fitted
  std::optional<robotics::Measurements> test;
  std::vector<Eigen::Index> outlier_lines;  ///< of the file: readings that were left out
  robotics::CalibrationReport report;
  std::vector<JudgedModel> models;
  std::vector<Finding> input_mistakes;
  std::optional<robotics::Coverage> used;  ///< of the poses of the test file
  std::optional<CalibrationDetails> details;
  std::vector<robotics::LearningPoint> learning;  ///< empty if nobody asked for it, or of few poses
  std::optional<robotics::Suspicion> suspicion;   ///< of a mistake in the files
  bool is_implausible = false;                    ///< the calibrated robot must not be used
  Acceptance acceptance = {};                     ///< by the limit
  std::string refusal;                            ///< why the result is none, in a sentence; empty if it is one
};

/// Reads measurements of a robot.
using ReadMeasurements = std::function<robotics::Measurements(const robotics::Robot&)>;

/// Calibrates the described robot. `read_test` gives measurements that take no part; it may be empty. Throws
/// std::runtime_error with the names of the files, and as robotics::report_calibration().
CalibrationRun run_calibration(const robotics::Robot& described, const robotics::Measurements& measured,
                               const ReadMeasurements& read_test, CalibrationTask task);

/// `output`: the file of the calibrated description; empty: none.
Json calibration_json(const CalibrationRun& run, const std::string& output);

}  // namespace llmt::report
