#include "report/fit/comparison.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "report/document/figures.hpp"
#include "report/fit/mean_of_rows.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

struct Compared {
  const std::string& target;
  const ComparisonResult& result;
};

Chart errors_chart(const Compared& of) {
  std::vector<std::string> names;
  Numbers errors;
  for (const Comparison& method : of.result.methods) {
    names.push_back(method.method);
    errors.push_back(method.cv_rmse);
  }
  Chart chart = ranking("Error on rows held out", fmt::format("RMSE of {}", of.target), names, errors, {});
  Layer& bars = chart.layers.front();
  for (const Comparison& method : of.result.methods) {
    bars.low.push_back(method.cv_rmse - method.spread);
    bars.high.push_back(method.cv_rmse + method.spread);
    bars.roles.push_back("muted");
  }
  bars.roles[of.result.recommended] = "model";
  chart.caption = "Blue: recommended. Whiskers: standard deviation over the folds.";
  return chart;
}

// One method's figures over another's, a point with its name for each method.
Chart trade(const Compared& of, const std::string& title, const std::string& axis,
            const std::function<double(const Comparison&)>& figure) {
  Chart chart{.title = title, .x = {axis, true}, .y = {fmt::format("RMSE of {}", of.target)}, .layers = {}};
  for (const bool recommended : {false, true}) {
    Layer points{.name = recommended ? "recommended" : "others", .role = recommended ? "model" : "data"};
    for (std::size_t k = 0; k < of.result.methods.size(); ++k) {
      const Comparison& method = of.result.methods[k];
      if ((k == of.result.recommended) != recommended) continue;
      points.x.push_back(figure(method));
      points.y.push_back(method.cv_rmse);
      points.labels.push_back(method.method);
    }
    chart.layers.push_back(std::move(points));
  }
  return chart;
}

Chart folds_chart(const Compared& of) {
  Chart chart{.title = "Every fold",
              .caption = "Folds differ in how hard they are; a method that is better in each of them is better.",
              .x = {"fold"},
              .y = {fmt::format("RMSE of {}", of.target)},
              .layers = {}};
  for (std::size_t k = 0; k < of.result.methods.size(); ++k) {
    const Comparison& method = of.result.methods[k];
    Layer line{.mark = Mark::line, .role = k == of.result.recommended ? "model" : "muted"};
    line.name = k == of.result.recommended ? method.method : k == 0 ? "others" : "";
    for (Eigen::Index fold = 0; fold < method.fold_rmse.size(); ++fold) {
      line.x.push_back(static_cast<double>(fold + 1));
      line.y.push_back(method.fold_rmse(fold));
    }
    chart.layers.push_back(std::move(line));
  }
  return chart;
}

Json methods_table(const Compared& of, double rmse_of_mean) {
  Grid grid{.header = {"method", "leaves", "parameters", "RMSE held-out", "spread of folds", "in 90 %", "CRPS",
                       "largest jump", "fit, s", "predict 1e6 rows, s"},
            .rows = {},
            .marked = static_cast<int>(of.result.recommended),
            .wide = true};
  for (const Comparison& method : of.result.methods) {
    grid.rows.push_back({method.method, std::to_string(method.leaves), std::to_string(method.parameters),
                         number(method.cv_rmse), number(method.spread, 2),
                         std::isnan(method.coverage) ? "-" : fmt::format("{:.1f} %", 100.0 * method.coverage),
                         std::isnan(method.crps) ? "-" : number(method.crps),
                         std::isnan(method.largest_jump) ? "-" : number(method.largest_jump, 3),
                         number(method.fit_seconds, 2), number(method.predict_seconds, 2)});
  }
  grid.rows.push_back({mean_of_rows, "-", "1", number(rmse_of_mean), "-", "-", "-", "-", "-", "-"});
  return block(grid);
}

// What one tree costs in error beside a sum of trees, and what either can be asked.
std::string cost_of_reading(const std::vector<Comparison>& methods) {
  const Comparison* sum = nullptr;
  const Comparison* tree = nullptr;
  for (const Comparison& method : methods) {
    const Comparison*& best = method.is_sum ? sum : tree;
    if (best == nullptr || method.cv_rmse < best->cv_rmse) best = &method;
  }
  if (sum == nullptr || tree == nullptr || !(sum->cv_rmse > 0.0)) return "";
  const double cost = 100.0 * (tree->cv_rmse / sum->cv_rmse - 1.0);
  const std::string verdict =
      cost > 0.0 ? fmt::format("reading costs {:.1f} % more error", cost) : "reading costs nothing here";
  return fmt::format(
      " One tree ({}) {}, {} {}: {}. A tree has rules, equations, monotone inputs and derivatives; a sum has "
      "predictions, contributions of the inputs and C.",
      tree->method, number(tree->cv_rmse), sum->method, number(sum->cv_rmse), verdict);
}

}  // namespace

Document comparison_report(const FitRun& run, const std::string& target, const ComparisonResult& result) {
  const Compared of{target, result};
  const TrainingData& rows = run.rows;
  Document document{.title = fmt::format("llmt compare {}", file_name(run.data)), .answer = result.recommendation};
  document.lead = fmt::format(
      "{}: {} rows, {} inputs; {}, {} folds{}, every choice made inside the fold.{}", file_name(run.data),
      rows.inputs.rows(), rows.inputs.cols(), target, result.methods.front().fold_rmse.size(),
      run.options.folds.kind == FoldKind::contiguous ? " of contiguous rows" : "", cost_of_reading(result.methods));
  if (run.options.loss == Loss::tukey) {
    const std::vector<Eigen::Index> left_out = rows_left_out(result.loss_weights, rows.weights);
    const Eigen::Index weighted = rows.weights.size() > 0 ? (rows.weights.array() > 0.0).count() : rows.inputs.rows();
    document.notes = {left_out_by_loss(lines_at(run.lines, left_out), weighted)};
  }
  Eigen::VectorXd weights = rows.weights.size() > 0 ? rows.weights : Eigen::VectorXd::Ones(rows.outputs.rows()).eval();
  if (result.loss_weights.size() > 0) weights = (result.loss_weights.array() > 0.0).select(weights, 0.0);
  document.main = errors_chart(of);
  document.beside_main = {block(trade(of, "Error over size", "parameters", [](const Comparison& method) {
    return static_cast<double>(method.parameters);
  }))};
  document.sections.push_back({"To check",
                               "",
                               {block(folds_chart(of)),
                                block(trade(of, "Error over time", "time of a fit, s",
                                            [](const Comparison& method) { return method.fit_seconds; })),
                                methods_table(of, error_of_mean(rows.outputs.col(0), weights, {}).train)}});
  return document;
}

}  // namespace llmt::report
