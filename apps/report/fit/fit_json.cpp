#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "report/fit/fit_shape.hpp"
#include "report/fit/fit_summary.hpp"
#include "report/fit/mean_of_rows.hpp"

namespace llmt::report {
namespace {

Json candidate_json(const CandidateError& entry) {
  return {{"validity", name_of(entry.candidate.validity.kind)},
          {"width", entry.candidate.validity.width},
          {"jump", entry.candidate.jump < no_jump ? Json(entry.candidate.jump) : Json(nullptr)},
          {"estimation", name_of(entry.candidate.estimation)},
          {"ridge", entry.candidate.ridge},
          {"shrinkage", entry.candidate.shrinkage},
          {"sparse", entry.candidate.sparse},
          {"leaves", entry.candidate.leaves},
          {"local_models", entry.candidate.leaves},
          {"cv_rmse", finite_or_null(entry.rmse)},
          {"spread", finite_or_null(entry.spread)}};
}

Json equal_rows_json(const std::optional<EqualRowErrors>& errors) {
  if (!errors) return nullptr;
  Json json = {{"rows_new", errors->rows_new},
               {"rows_known", errors->rows_known},
               {"cv_rmse_new", Json::array()},
               {"cv_rmse_known", Json::array()}};
  for (const double rmse : errors->rmse_new) json["cv_rmse_new"].push_back(finite_or_null(rmse));
  for (const double rmse : errors->rmse_known) json["cv_rmse_known"].push_back(finite_or_null(rmse));
  return json;
}

// By how much the error grows without each input, and the standard error of that.
Json importance_json(const Model& model, const PermutationImportance& found, Eigen::Index output) {
  Json json = Json::array();
  for (Eigen::Index j = 0; j < model.num_inputs(); ++j) {
    json.push_back({{"input", model.inputs()[static_cast<std::size_t>(j)].name},
                    {"increase", finite_or_null(found.increase(output, j))},
                    {"standard_error", finite_or_null(found.standard_error(output, j))}});
  }
  return json;
}

double least_squares_rmse(const PartitionSummary& partition) {
  return partition.best_of_kind.empty() ? std::nan("") : partition.best_of_kind.front().rmse;
}

}  // namespace

Json fit_json(const FitRun& run, const FitResult& result) {
  Json json;
  json["data"] = run.data;
  json["rows"] = result.summary.samples;
  json["copies"] = result.summary.copies;
  json["repeats"] = result.summary.repeats;
  json["missing_values"] = result.summary.missing_values;
  json["rule"] = name_of(run.options.rule);
  json["min_leaf_samples"] = result.summary.min_leaf_samples;
  if (run.options.loss == Loss::tukey) {
    const std::vector<Eigen::Index> rows = rows_left_out(result.summary.loss_weights, run.rows.weights);
    json["rows_left_out"] = counted_from_one(rows);
    json["lines_left_out"] = lines_at(run.lines, rows);
  }
  json["inputs"] = Json::array();
  for (const InputColumn& input : result.model.inputs()) {
    json["inputs"].push_back(input.name);
  }
  if (const CodeChoice& codes = result.summary.codes; !codes.compared.empty()) {
    json["codes"] = {{"compared", names_of(result.model, codes.compared)},
                     {"taken", names_of(result.model, codes.taken)},
                     {"cv_rmse_as_numbers", codes.rmse_as_numbers},
                     {"cv_rmse_as_codes", codes.rmse_as_codes}};
  }
  json["local_models"] = result.summary.quadratic ? "quadratic" : "linear";
  const std::optional<PermutationImportance> found = held_out_importance(
      result, run.rows.inputs, run.rows.outputs, counted_weights(run, result), run.options.max_threads);
  json["partitions"] = Json::array();
  for (const PartitionSummary& partition : result.summary.partitions) {
    Json entry;
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      entry["targets"].push_back(result.model.outputs()[partition.outputs[o]].name);
      entry["train_rmse"].push_back(partition.train_rmse(o));
    }
    entry["leaves"] = partition.leaves;
    entry["local_models"] = partition.leaves;  // one each
    entry["grown_leaves"] = partition.grown_leaves;
    entry["coefficients"] = partition.coefficients;
    entry["rank_deficient_leaves"] = partition.rank_deficient_leaves;
    entry["growth_ended_by"] = describe(partition.stop);
    entry["search"] = {{"exact_nodes", partition.search.exact_nodes},
                       {"binned_nodes", partition.search.binned_nodes},
                       {"evaluations", partition.search.evaluations},
                       {"largest_excess", partition.search.largest_excess}};
    entry["left_out"] = names_of(result.model, partition.left_out);
    entry["cv_rmse_by_inputs"] = Json::array();
    for (const InputStep& step : partition.input_steps) {
      entry["cv_rmse_by_inputs"].push_back({{"inputs", step.inputs}, {"cv_rmse", step.rmse}});
    }
    entry["cv_folds"] = partition.cv_folds;
    const bool judged = partition.cv_folds > 0;
    entry["chosen"] = candidate_json(partition.chosen);
    entry["compared"] = Json::array();
    for (const CandidateError& other : partition.best_of_kind) {
      entry["compared"].push_back(candidate_json(other));
    }
    entry["cv_rmse"] = judged ? Json(partition.chosen.rmse) : Json(nullptr);
    entry["equal_rows"] = equal_rows_json(partition.equal_rows);
    entry["range_guards"] = Json::array();  // one a target
    for (const RangeGuard& guard : partition.range_guards) {
      entry["range_guards"].push_back(
          {{"taken", guard.taken}, {"cv_rmse_without", guard.rmse_without}, {"cv_rmse_with", guard.rmse_with}});
    }
    entry["cv_rmse_least_squares"] = judged ? Json(least_squares_rmse(partition)) : Json(nullptr);
    entry["crisp_cv_rmse_by_leaves"] =
        std::vector<double>(partition.crisp_cv_rmse.begin(), partition.crisp_cv_rmse.end());
    if (found) {
      entry["importance"] = Json::array();  // one a target
      for (const int output : partition.outputs)
        entry["importance"].push_back(importance_json(result.model, *found, output));
    }
    if (!result.summary.other_terms.empty()) {
      entry["other_terms"] = candidate_json(result.summary.other_terms[json["partitions"].size()]);
    }
    json["partitions"].push_back(std::move(entry));
  }
  json["model"] = run.output.empty() ? Json(nullptr) : Json(run.output);
  return json;
}

}  // namespace llmt::report
