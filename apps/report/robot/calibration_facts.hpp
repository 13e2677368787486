/// \file
/// What reports say of a calibration beside its values: errors of its models, and what the poses determine.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/robotics/calibration_quality.hpp"
#include "llmt/robotics/calibration_report.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// A model, with its errors on the poses of the calibration and on a test file.
struct JudgedModel {
  std::string name;
  robotics::Stage stage;
  std::optional<robotics::ErrorFigures> test = {};
  std::optional<robotics::ErrorFigures> test_mrad = {};
};

/// How well the poses determine the parameters.
struct CalibrationDetails {
  double leave_one_out_mm = 0.0;
  robotics::Observability seen;
  std::optional<robotics::RepeatNoise> repeats;
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

}  // namespace llmt::report
