#include "report/fit/fit_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

Chart slice(const Fitted& fitted, Eigen::Index output, int input) {
  const Model& model = fitted.result.model;
  const InputColumn& column = model.inputs()[input];
  const int places = column.is_categorical() ? static_cast<int>(column.levels.size()) : 161;
  Eigen::MatrixXd queries = reference_point(model).transpose().replicate(places, 1);
  Numbers xs = column.is_categorical() ? Numbers() : steps_between(column.low, column.high, places);
  for (int k = 0; k < places && column.is_categorical(); ++k) xs.push_back(k);
  for (int k = 0; k < places; ++k) queries(k, input) = xs[k];
  if (!column.codes.empty()) {
    for (std::size_t k = 0; k < column.codes.size(); ++k)
      queries(static_cast<Eigen::Index>(k), input) = column.codes[k];
  }
  if (column.has_empty_level()) queries(places - 1, input) = std::nan("");
  Chart chart{.title = fmt::format("Along {}", column.name),
              .x = {column.name},
              .y = {model.outputs()[output].name},
              .layers = {}};
  if (column.is_categorical()) {
    for (std::size_t k = 0; k < column.levels.size(); ++k) chart.x.categories.push_back(column.shown_level(k));
    chart.layers.push_back(
        {.mark = Mark::bars, .role = "model", .x = xs, .y = numbers_of(model.predict(queries).col(output))});
    return chart;
  }
  const bool readable = fitted.readable.has_value();
  if (readable) {
    const Model& rules = fitted.readable->model;
    chart.layers.push_back({.mark = Mark::line,
                            .name = "readable tree",
                            .role = "before",
                            .x = xs,
                            .y = numbers_of(rules.predict(queries).col(output)),
                            .dashed = true});
  }
  chart.layers.push_back({.mark = Mark::line,
                          .name = readable ? "model" : "",
                          .role = "model",
                          .x = xs,
                          .y = numbers_of(model.predict(queries).col(output))});
  return chart;
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
