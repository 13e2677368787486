#include "report/fit/comparison.hpp"

#include <vector>

namespace llmt::report {
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
                               {"coverage_90", finite_or_null(method.coverage)},
                               {"crps", finite_or_null(method.crps)},
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

}  // namespace llmt::report
