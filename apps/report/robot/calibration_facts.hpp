/// \file
/// A calibration as text and as JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/robotics/calibration_quality.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// A model, with its errors on the poses of the calibration and on a test file.
struct JudgedModel {
  std::string name;
  const robotics::Stage* stage;
  std::optional<robotics::ErrorFigures> test = {};
  std::optional<robotics::ErrorFigures> test_mrad = {};
};

/// How well the poses determine the parameters.
struct CalibrationDetails {
  double leave_one_out_mm = 0.0;
  robotics::Observability seen;
  std::optional<robotics::RepeatNoise> repeats;
  std::vector<robotics::LearningPoint> learning;
  struct Correlation {
    std::string first;
    std::string second;
    double value = 0.0;
  };
  std::vector<Correlation> correlations;  ///< the strongest
  struct Share {
    std::string of;
    double share = 0.0;  ///< of the mean square error of the described robot
  };
  std::vector<Share> shares;
};

/// What was calibrated by what, and how it went.
struct CalibrationFacts {
  std::string robot_file;
  std::string data_file;
  std::string output;  ///< the file of the calibrated description; empty: none
  std::string note;    ///< a line that ends the head of the text; may be empty
  bool contiguous = false;
  const robotics::Robot& nominal;
  const robotics::Measurements& measurements;
  const robotics::CalibrationReport& report;
  std::vector<JudgedModel> models;
  std::vector<std::string> suspicions;
  std::vector<Eigen::Index> outlier_lines;  ///< of the file: readings that were left out
  std::optional<robotics::Coverage> used;   ///< of the poses of the test file
  std::optional<CalibrationDetails> details;
};

/// The models of a report. On a test file, frames that the calibration does not know, or with `new_session` all, are
/// fitted to it first.
std::vector<JudgedModel> judged_models(const robotics::CalibrationReport& report,
                                       const robotics::Measurements& measurements,
                                       const std::optional<robotics::Measurements>& test, bool new_session);

CalibrationDetails calibration_details(const robotics::Robot& nominal, const robotics::Measurements& measurements,
                                       const robotics::CalibrationReport& report,
                                       const robotics::ReportOptions& options);

/// mean, p95, max, rms.
Json figures_json(const robotics::ErrorFigures& figures);

Json calibration_json(const CalibrationFacts& facts);
/// For people: verdict, parameters, errors. `width`: of tables.
std::string calibration_text(const CalibrationFacts& facts, std::size_t width = no_width_limit);

}  // namespace llmt::report
