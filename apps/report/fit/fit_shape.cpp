#include "report/fit/fit_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "llmt/explain.hpp"
#include "report/document/figures.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

constexpr int most_shown_inputs = 15;

}  // namespace

std::vector<int> by_importance(const Eigen::VectorXd& shares) {
  std::vector<int> order(shares.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater{}, [&](int j) { return shares(j); });
  std::erase_if(order, [&](int j) { return !(shares(j) > 0.0); });
  return order;
}

Chart importance_chart(const Model& model, const Eigen::VectorXd& shares, const std::vector<int>& order) {
  std::vector<std::string> names;
  Numbers values;
  std::vector<std::string> labels;
  for (const int j : order) {
    if (std::ssize(names) == most_shown_inputs) break;
    names.push_back(model.inputs()[j].name);
    values.push_back(100.0 * shares(j));
    labels.push_back(fmt::format("{:.0f} %", 100.0 * shares(j)));
  }
  Chart chart = ranking("What moves the prediction", "share, %", names, values, labels);
  chart.caption = "The mean size of each input's share in the predictions: what the model uses, not what causes.";
  return chart;
}

std::optional<PermutationImportance> held_out_importance(const FitResult& result, const Eigen::MatrixXd& inputs,
                                                         const Eigen::MatrixXd& outputs, const Eigen::VectorXd& weights,
                                                         int max_threads) {
  const std::vector<Model>& models = result.intervals.models();
  if (models.empty() || models.size() != result.summary.held_out.size()) return std::nullopt;
  return permutation_importance(models, inputs, outputs, result.summary.held_out, weights,
                                {.max_threads = max_threads});
}

Chart increase_chart(const Model& model, const PermutationImportance& found, Eigen::Index output) {
  const Eigen::VectorXd increase = found.increase.row(output).transpose();
  std::vector<std::string> names;
  Numbers values;
  for (const int j : by_importance(increase)) {
    if (std::ssize(names) == most_shown_inputs) break;
    names.push_back(model.inputs()[j].name);
    values.push_back(increase(j));
  }
  Chart chart =
      ranking("What matters", fmt::format("RMSE of {} grows by", model.outputs()[output].name), names, values, {});
  Layer& bars = chart.layers.front();
  for (const int j : by_importance(increase)) {
    if (bars.low.size() == names.size()) break;
    const double twice = 2.0 * found.standard_error(output, j);
    bars.low.push_back(increase(j) - twice);
    bars.high.push_back(increase(j) + twice);
    bars.roles.push_back(increase(j) > twice ? "model" : "muted");
  }
  chart.caption =
      "By how much the error on rows held out grows when the values of an input are exchanged between rows. Whiskers: "
      "two "
      "standard errors; grey: within them.";
  return chart;
}

namespace {

constexpr Eigen::Index averaged_rows = 200;
constexpr Eigen::Index thin_lines = 25;

// Where an input is looked at: all levels, or 41 places from the smallest to the largest value of training.
Numbers places_of(const InputColumn& column) {
  if (!column.is_categorical()) return steps_between(column.low, column.high, 41);
  Numbers places = column.codes;
  while (places.size() < column.levels.size()) places.push_back(static_cast<double>(places.size()));
  if (column.has_empty_level()) places.back() = std::nan("");
  return places;
}

// Predictions of one output, rows x places, with an input at each of the places.
Eigen::MatrixXd along(const Model& model, Eigen::MatrixXd rows, int input, const Numbers& places, Eigen::Index output) {
  Eigen::MatrixXd predicted(rows.rows(), std::ssize(places));
  for (std::size_t k = 0; k < places.size(); ++k) {
    rows.col(input).setConstant(places[k]);
    predicted.col(static_cast<Eigen::Index>(k)) = model.predict(rows).col(output);
  }
  return predicted;
}

}  // namespace

Chart slice(const Fitted& fitted, Eigen::Index output, int input) {
  const Model& model = fitted.result.model;
  const InputColumn& column = model.inputs()[input];
  const Numbers places = places_of(column);
  const Eigen::MatrixXd rows = fitted.inputs(thinned(fitted.inputs.rows(), averaged_rows), Eigen::all);
  const Eigen::MatrixXd predicted = along(model, rows, input, places, output);
  Chart chart{.title = fmt::format("Along {}", column.name),
              .x = {column.name},
              .y = {model.outputs()[output].name},
              .layers = {}};
  const Numbers means = numbers_of(predicted.colwise().mean().transpose());
  if (column.is_categorical()) {
    Numbers positions;
    for (std::size_t k = 0; k < column.levels.size(); ++k) {
      chart.x.categories.push_back(column.shown_level(k));
      positions.push_back(static_cast<double>(k));
    }
    chart.layers.push_back({.mark = Mark::points, .role = "model", .x = positions, .y = means, .size = 10});
    return chart;
  }
  for (const Eigen::Index row : thinned(predicted.rows(), thin_lines)) {
    chart.layers.push_back(
        {.mark = Mark::line, .role = "muted", .x = places, .y = numbers_of(predicted.row(row).transpose()), .size = 1});
  }
  const bool readable = fitted.readable.has_value();
  if (readable) {
    const Eigen::MatrixXd by_rules = along(fitted.readable->model, rows, input, places, output);
    chart.layers.push_back({.mark = Mark::line,
                            .name = "readable tree",
                            .role = "before",
                            .x = places,
                            .y = numbers_of(by_rules.colwise().mean().transpose()),
                            .dashed = true});
  }
  chart.layers.push_back(
      {.mark = Mark::line, .name = readable ? "model" : "", .role = "model", .x = places, .y = means});
  return chart;
}

void on_one_axis(const Fitted& fitted, const std::vector<int>& inputs, std::vector<Chart>& slices) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const Chart& chart : slices) {
    for (const Layer& layer : chart.layers) {
      for (const double y : layer.y) {
        if (!std::isfinite(y)) continue;
        low = std::min(low, y);
        high = std::max(high, y);
      }
    }
  }
  if (!(low < high)) return;
  const double margin = 0.06 * (high - low);
  for (std::size_t k = 0; k < slices.size(); ++k) {
    slices[k].y.range = {low - margin, high + 0.5 * margin};
    if (!slices[k].x.categories.empty()) continue;
    Layer rug{.role = "data", .size = 3};
    for (const Eigen::Index row : thinned(fitted.inputs.rows(), averaged_rows)) {
      rug.x.push_back(fitted.inputs(row, inputs[k]));
      rug.y.push_back(low - 0.6 * margin);
    }
    slices[k].layers.push_back(std::move(rug));
  }
}

Chart waterfall(const Fitted& fitted, Eigen::Index output) {
  const Model& model = fitted.result.model;
  const Eigen::VectorXd predicted = model.predict(fitted.inputs, fitted.options.max_threads).col(output);
  Eigen::Index row = 0;
  predicted.maxCoeff(&row);
  const Attribution shares = attribute(model, fitted.inputs.row(row).transpose());
  const Eigen::VectorXd parts = shares.contributions.row(output).transpose();
  const std::vector<int> order = by_importance(parts.cwiseAbs());
  std::vector<std::string> names = {"at the means of all inputs"};
  Layer bars{.mark = Mark::bars,
             .role = "model",
             .x = {0.0},
             .y = {shares.reference(output)},
             .base = {0.0},
             .labels = {number(shares.reference(output))},
             .roles = {"muted"},
             .horizontal = true};
  double at = shares.reference(output);
  double rest = 0.0;
  int others = 0;
  const auto add = [&](const std::string& name, double part) {
    bars.x.push_back(static_cast<double>(names.size()));
    bars.y.push_back(part);
    bars.base.push_back(at);
    bars.labels.push_back(fmt::format("{}{}", part < 0.0 ? "-" : "+", number(std::abs(part), 3)));
    bars.roles.push_back(part < 0.0 ? "down" : "up");
    names.push_back(name);
    at += part;
  };
  for (const int j : order) {
    if (std::ssize(names) > 8) {
      rest += parts(j);
      ++others;
      continue;
    }
    const InputColumn& column = model.inputs()[j];
    const double value = fitted.inputs(row, j);
    const std::string text = std::isnan(value) ? "missing"
                             : column.is_categorical() && column.codes.empty()
                                 ? column.shown_level(static_cast<std::size_t>(value))
                                 : number(value);
    add(fmt::format("{} = {}", column.name, text), parts(j));
  }
  if (others > 0) add(fmt::format("{} other inputs", others), rest);
  bars.x.push_back(static_cast<double>(names.size()));
  bars.y.push_back(shares.prediction(output));
  bars.base.push_back(0.0);
  bars.labels.push_back(number(shares.prediction(output)));
  bars.roles.push_back("model");
  names.push_back("prediction");
  return {
      .title = fmt::format("Row {}: why {}", row + 1, number(shares.prediction(output))),
      .caption = fmt::format("The row with the highest prediction; observed: {}. `llmt explain` does this for any row.",
                             number(fitted.outputs(row, output))),
      .x = {model.outputs()[output].name},
      .y = {"", false, names},
      .layers = {bars},
      .wide = true};
}

}  // namespace llmt::report
