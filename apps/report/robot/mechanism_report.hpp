/// \file
/// The calibration of a mechanism as text and as JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/robotics/mechanism/mechanism_calibration.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// What was calibrated by what, and how it went.
struct MechanismFacts {
  std::string file;
  std::string data;
  robotics::Mechanism described;
  Eigen::MatrixXd measured;
  int folds = 0;
  std::vector<Eigen::Index> contradicting = {};  ///< lines of poses that contradict the others
  bool robust = false;                           ///< those are left out, and not in `measured`
  robotics::MechanismCalibration calibration = {};
  robotics::MechanismErrors before = {};
  std::optional<robotics::MechanismErrors> held_out = {};

  /// Whether the readings leave degrees of freedom beyond the parameters.
  bool is_determined() const { return calibration.result.dof > 0; }
  bool is_good() const { return is_determined() && calibration.result.converged(); }
};

/// For people: verdict, errors, parameters. `width`: of tables.
std::string mechanism_text(const MechanismFacts& facts, std::size_t width = no_width_limit);
Json mechanism_json(const MechanismFacts& facts);

/// Readings and errors per pose: held out, or of the calibrated mechanism if there are no folds. The columns of errors
/// are "x_error_mm", or "contradiction" where no output is predicted.
std::string mechanism_errors_csv(const MechanismFacts& facts);

}  // namespace llmt::report
