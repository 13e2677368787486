#include "report/fit/fit_accuracy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "report/document/figures.hpp"
#include "report/fit/kinds.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

HeldOutRows held_out(const Fitted& fitted, Eigen::Index output) {
  HeldOutRows rows;
  rows.left_out = fitted.left_out;
  const auto add = [&](const Model& model, const std::vector<Eigen::Index>& of_rows) {
    const Eigen::VectorXd predicted =
        model.predict(fitted.inputs(of_rows, Eigen::all), fitted.options.max_threads).col(output);
    for (std::size_t k = 0; k < of_rows.size(); ++k) {
      rows.observed.push_back(fitted.outputs(of_rows[k], output));
      rows.predicted.push_back(predicted(k));
      rows.errors.push_back(predicted(k) - rows.observed.back());
    }
  };
  const std::vector<Model>& models = fitted.result.intervals.models();
  rows.held_out = !models.empty();
  if (rows.held_out) {
    for (std::size_t f = 0; f < models.size(); ++f) add(models[f], fitted.result.summary.held_out[f]);
  } else {
    std::vector<Eigen::Index> all(fitted.inputs.rows());
    std::iota(all.begin(), all.end(), 0);
    add(fitted.result.model, all);
  }
  const Eigen::Map<const Eigen::ArrayXd> errors(rows.errors.data(), std::ssize(rows.errors));
  const Eigen::Map<const Eigen::ArrayXd> observed(rows.observed.data(), std::ssize(rows.observed));
  rows.rmse = std::sqrt(errors.square().mean());
  rows.r2 = 1.0 - errors.square().sum() / (observed - observed.mean()).square().sum();
  Numbers sizes(rows.errors);
  for (double& size : sizes) size = std::abs(size);
  rows.p90 = quantile(sizes, 0.9);
  return rows;
}

namespace {

// What the charts of single rows do not show.
std::string left_out_note(const HeldOutRows& rows) {
  if (rows.left_out == 0) return "";
  return rows.left_out == 1 ? " 1 row that the Tukey loss left out is not shown."
                            : fmt::format(" {} rows that the Tukey loss left out are not shown.", rows.left_out);
}

}  // namespace

Chart predicted_against_observed(const HeldOutRows& rows, const std::string& name) {
  const std::string without = rows.left_out > 0 ? fmt::format(", without {} left out", rows.left_out) : "";
  Layer points{.name = "rows" + without, .role = "model"};
  const auto count = static_cast<Eigen::Index>(rows.observed.size());
  for (const Eigen::Index row : thinned(count)) {
    points.x.push_back(rows.predicted[row]);
    points.y.push_back(rows.observed[row]);
  }
  const auto [low, high] = std::ranges::minmax(rows.observed);
  const auto line = [low = low, high = high](double shift, const std::string& text, bool dashed) {
    return Layer{.mark = Mark::line,
                 .name = text,
                 .role = "floor",
                 .x = {low, high},
                 .y = {low + shift, high + shift},
                 .dashed = dashed};
  };
  return {.title = fmt::format("{}: predicted and observed", name),
          .caption = fmt::format("{} Between the dashed lines are nine of ten rows: the error there is at most {}.{}",
                                 rows.held_out ? "Every prediction is by a model that had not seen the row."
                                               : "No rows were held out: these rows were fitted.",
                                 number(rows.p90, 3), thinning_note(count, "rows") + left_out_note(rows)),
          .x = {fmt::format("predicted {}", name)},
          .y = {fmt::format("observed {}", name)},
          .layers = {points, line(0.0, "no error", false), line(rows.p90, "nine of ten rows", true),
                     line(-rows.p90, "", true)}};
}

Chart residuals(const HeldOutRows& rows, const std::string& name) {
  Layer points{.role = "model"};
  const auto count = static_cast<Eigen::Index>(rows.errors.size());
  for (const Eigen::Index row : thinned(count)) {
    points.x.push_back(rows.predicted[row]);
    points.y.push_back(rows.errors[row]);
  }
  return {.title = "Errors over the prediction",
          .caption = "A curve or a funnel here would be structure that the model missed." +
                     thinning_note(count, "rows") + left_out_note(rows),
          .x = {fmt::format("predicted {}", name)},
          .y = {"predicted - observed"},
          .layers = {points},
          .references = {{false, 0.0, "", "floor"}}};
}

Chart error_over_leaves(const PartitionSummary& partition) {
  Chart chart{.title = "Error over the number of equations",
              .caption =
                  "On rows held out. Bars: standard deviation over the folds. More leaves help until noise is "
                  "learned.",
              .x = {"leaves (equations)", true},
              .y = {"RMSE on rows held out"},
              .layers = {}};
  Layer line{.mark = Mark::line, .name = "crisp tree", .role = "data"};
  for (Eigen::Index k = 0; k < partition.crisp_cv_rmse.size(); ++k) {
    line.x.push_back(static_cast<double>(k + 1));
    line.y.push_back(partition.crisp_cv_rmse(k));
  }
  if (line.x.size() > 1) chart.layers.push_back(std::move(line));
  const auto add = [&](const CandidateError& entry, const std::string& name, const std::string& role) {
    const auto x = static_cast<double>(entry.candidate.leaves);
    chart.layers.push_back({.name = name, .role = role, .x = {x}, .y = {entry.rmse}});
    chart.layers.push_back(
        {.mark = Mark::line, .role = role, .x = {x, x}, .y = {entry.rmse - entry.spread, entry.rmse + entry.spread}});
  };
  const std::vector<CandidateError> shown = best_of_kinds(partition);
  for (std::size_t k = 1; k < shown.size(); ++k) add(shown[k], kind_of(shown[k].candidate), "before");
  add(partition.chosen, "chosen: " + kind_of(partition.chosen.candidate), "model");
  return chart;
}

Chart error_histogram(const HeldOutRows& rows) {
  Chart chart = histogram("How large the errors are", "predicted - observed", {{"", "model", rows.errors}});
  chart.references = {{true, -rows.p90, ""}, {true, rows.p90, "nine of ten"}};
  return chart;
}

}  // namespace llmt::report
