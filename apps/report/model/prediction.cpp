#include "report/model/prediction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "report/text/text.hpp"

namespace llmt::report {
namespace {

Eigen::Index count_outside(const Prediction& prediction) {
  return std::ranges::count_if(prediction.extrapolation, [](const Extrapolation& row) { return row.distance > 0.0; });
}

// Local models that are carried beyond their rows although every input lies in its range.
Eigen::Index count_high_leverage(const Prediction& prediction) {
  return std::ranges::count_if(prediction.extrapolation, [](const Extrapolation& row) {
    return row.distance == 0.0 && row.leverage > 1.0 + 1e-9;
  });
}

std::size_t count_uncalibrated(const Prediction& prediction) {
  return prediction.bounds ? prediction.bounds->uncalibrated.size() : 0;
}

std::vector<double> column_of(const Eigen::MatrixXd& values, Eigen::Index column) {
  return {values.col(column).begin(), values.col(column).end()};
}

}  // namespace

Eigen::Index count_not_finite(const Prediction& prediction) {
  return prediction.values.size() - prediction.values.array().isFinite().count();
}

Json prediction_json(const Prediction& prediction, bool with_values) {
  Json json;
  json["rows"] = prediction.values.rows();
  json["outside_rows"] = count_outside(prediction);
  json["missing_values"] = prediction.missing;
  json["unknown_categories"] = prediction.unknown;
  if (prediction.unseen_codes > 0) json["unseen_codes"] = prediction.unseen_codes;
  if (const Eigen::Index count = count_not_finite(prediction); count > 0) json["not_finite_predictions"] = count;
  if (const std::size_t count = count_uncalibrated(prediction); count > 0) json["uncalibrated_intervals"] = count;
  if (prediction.bounds && !prediction.bounds->in_gap.empty()) {
    json["rows_in_gaps"] = Json::array();
    for (const Eigen::Index row : prediction.bounds->in_gap) json["rows_in_gaps"].push_back(row + 1);
  }
  json["targets"] = Json::array();
  for (std::size_t o = 0; o < prediction.targets.size(); ++o) {
    const Eigen::Index column = o;
    Json target = {{"name", prediction.targets[o]}, {"rmse", finite_or_null(prediction.rmse(column))}};
    if (with_values) {
      target["predicted"] = column_of(prediction.values, column);
      if (prediction.bounds) {
        target["low"] = column_of(prediction.bounds->lower, column);
        target["high"] = column_of(prediction.bounds->upper, column);
      }
      for (std::size_t k = 0; k < prediction.probabilities.size() && !prediction.quantiles.empty(); ++k) {
        target["quantiles"].push_back({{"probability", prediction.probabilities[k]},
                                       {"values", column_of(prediction.quantiles[o], static_cast<Eigen::Index>(k))}});
      }
    }
    json["targets"].push_back(std::move(target));
  }
  if (!with_values) return json;
  json["outside_by"] = Json::array();
  if (prediction.has_leverage) json["leverage"] = Json::array();
  for (const Extrapolation& row : prediction.extrapolation) {
    json["outside_by"].push_back(std::isfinite(row.distance) ? Json(row.distance) : Json("infinity"));
    if (prediction.has_leverage) json["leverage"].push_back(row.leverage);
  }
  return json;
}

std::string prediction_text(const Prediction& prediction, const std::string& data) {
  std::string text = fmt::format("{}: {} rows predicted", data, prediction.values.rows());
  for (std::size_t o = 0; o < prediction.targets.size(); ++o) {
    const double error = prediction.rmse(o);
    text += std::isnan(error) ? "" : fmt::format("; RMSE of {} {}", prediction.targets[o], number(error));
  }
  if (const Eigen::Index outside = count_outside(prediction); outside > 0) {
    double farthest = 0.0;
    for (const Extrapolation& row : prediction.extrapolation) farthest = std::max(farthest, row.distance);
    text += fmt::format("; {} outside the range of the training rows, by up to {} % of an input's range", outside,
                        number(100.0 * farthest, 2));
  }
  if (const Eigen::Index rows = count_high_leverage(prediction); rows > 0) {
    text += fmt::format(
        "; {} within the range of every input, but far from the rows that their leaf learned from (leverage above 1): "
        "their errors may be larger",
        rows);
  }
  if (prediction.missing > 0) text += fmt::format("; {} missing values", prediction.missing);
  if (prediction.unknown > 0) {
    text += fmt::format("; {} value{} of categories that were not in training", prediction.unknown,
                        prediction.unknown == 1 ? "" : "s");
  }
  if (prediction.unseen_codes > 0) {
    text += fmt::format("; {} codes that were not in training, taken as the nearest", prediction.unseen_codes);
  }
  if (const std::size_t count = prediction.bounds ? prediction.bounds->in_gap.size() : 0; count > 0) {
    text += fmt::format(
        "; {} row{} in a gap of the training rows, within their range but far from all of them (in_gap): the "
        "interval{} therefore wider",
        count, count == 1 ? " lies" : "s lie", count == 1 ? " is" : "s are");
  }
  if (const std::size_t count = count_uncalibrated(prediction); count > 0) {
    text += fmt::format(
        "; {} interval{} likely too narrow, because the row{} an empty cell or an unknown category, as too few "
        "training "
        "rows had",
        count, count == 1 ? " is" : "s are", count == 1 ? " has" : "s have");
  }
  return text;
}

}  // namespace llmt::report
