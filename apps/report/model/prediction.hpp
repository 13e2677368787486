/// \file
/// Predictions for a table as text and as JSON.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "llmt/intervals.hpp"
#include "llmt/model.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// What a model says of the rows of a table.
struct Prediction {
  std::vector<std::string> targets;
  Eigen::MatrixXd values;  ///< rows x targets
  std::vector<Extrapolation> extrapolation;
  bool has_leverage = true;  ///< not of boosted models
  std::optional<Bounds> bounds;
  std::vector<double> probabilities = {};       ///< of the quantiles
  std::vector<Eigen::MatrixXd> quantiles = {};  ///< one a target, rows x probabilities; empty: none
  Eigen::Index missing = 0;                     ///< cells, as ModelInputs
  Eigen::Index unknown = 0;                     ///< as ModelInputs
  Eigen::Index unseen_codes = 0;                ///< as ModelInputs
  /// Root mean square errors of the targets that the table also holds, in the order of targets; NaN for the others.
  Eigen::VectorXd rmse;
};

/// Predictions that are infinite or NaN.
Eigen::Index count_not_finite(const Prediction& prediction);

/// Counts and errors; `with_values`: also the prediction of every row, its bounds and how far it extrapolates.
Json prediction_json(const Prediction& prediction, bool with_values);

/// Counts and errors in a sentence. `data`: the name of the table.
std::string prediction_text(const Prediction& prediction, const std::string& data);

}  // namespace llmt::report
