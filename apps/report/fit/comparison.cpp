#include "report/fit/comparison.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

namespace llmt::report {
namespace {

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
      "One tree ({}) {}, {} {}: {}. A tree has rules, equations, monotone inputs and derivatives; a sum has "
      "predictions, contributions of the inputs and C.\n",
      tree->method, number(tree->cv_rmse), sum->method, number(sum->cv_rmse), verdict);
}

}  // namespace

Json comparison_json(const FitRun& run, const std::string& target, const ComparisonResult& result) {
  Json json;
  json["data"] = run.data;
  json["rows"] = run.rows.inputs.rows();
  json["target"] = target;
  json["folds"] = result.methods.front().fold_rmse.size();
  json["methods"] = Json::array();
  for (const Comparison& method : result.methods) {
    json["methods"].push_back({{"method", method.method},
                               {"trees", method.trees},
                               {"leaves", method.leaves},
                               {"parameters", method.parameters},
                               {"cv_rmse", method.cv_rmse},
                               {"spread", method.spread},
                               {"fold_rmse", std::vector<double>(method.fold_rmse.begin(), method.fold_rmse.end())},
                               {"largest_jump", finite_or_null(method.largest_jump)},
                               {"fit_seconds", method.fit_seconds},
                               {"predict_seconds_per_million_rows", method.predict_seconds}});
  }
  if (run.options.loss == Loss::tukey) {
    const std::vector<Eigen::Index> rows = rows_left_out(result.loss_weights, run.rows.weights);
    json["rows_left_out"] = counted_from_one(rows);
    json["lines_left_out"] = lines_at(run.lines, rows);
  }
  json["recommended"] = result.methods[result.recommended].method;
  json["recommendation"] = result.recommendation;
  return json;
}

std::string comparison_text(const FitRun& run, const std::string& target, const ComparisonResult& result,
                            std::size_t width) {
  std::string text =
      fmt::format("{}: {} rows, {} inputs; {}, {} folds{}, every choice made inside the fold\n\n", run.data,
                  run.rows.inputs.rows(), run.rows.inputs.cols(), target, result.methods.front().fold_rmse.size(),
                  run.options.folds.kind == FoldKind::contiguous ? " of contiguous rows" : "");
  if (run.options.loss == Loss::tukey) {
    const Eigen::VectorXd& weights = run.rows.weights;
    const std::vector<Eigen::Index> rows = rows_left_out(result.loss_weights, weights);
    const Eigen::Index weighted = weights.size() > 0 ? (weights.array() > 0.0).count() : run.rows.inputs.rows();
    text += left_out_by_loss(lines_at(run.lines, rows), weighted) + "\n";
  }
  Table table({"method", "leaves", "parameters", "RMSE held-out", "spread of folds", "largest jump", "fit, s",
               "predict 1e6 rows, s"});
  for (const Comparison& method : result.methods) {
    const std::string jump = std::isnan(method.largest_jump) ? "-" : number(method.largest_jump, 3);
    table.add({method.method, fmt::format("{}", method.leaves), fmt::format("{}", method.parameters),
               number(method.cv_rmse), number(method.spread, 2), jump, number(method.fit_seconds, 2),
               number(method.predict_seconds, 2)});
  }
  return text + table.text(width) + "\n" + result.recommendation + "\n" +
         wrapped(cost_of_reading(result.methods), width);
}

}  // namespace llmt::report
