#include "llmt/fit_summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

namespace llmt::apps {
namespace {

// "blend, sparse, width 2, jumps from 4, ridge 0.001, shrinkage 0.1".
std::string describe(const Candidate& candidate) {
  const char* const sparse = candidate.sparse ? ", sparse" : "";
  if (candidate.validity.kind == ValidityKind::crisp) {
    const std::string name = fmt::format("{}{}", candidate.leaves == 1 ? "least squares" : "crisp", sparse);
    if (candidate.leaves == 1 && candidate.shrinkage > 0.0) {
      return fmt::format("ridge regression, shrinkage {}", number(candidate.shrinkage, 3));
    }
    return candidate.shrinkage > 0.0 ? fmt::format("{}, shrinkage {}", name, candidate.shrinkage) : name;
  }
  const std::string_view kind = candidate.validity.kind == ValidityKind::gaussian   ? "Gaussians"
                                : candidate.validity.kind == ValidityKind::logistic ? "gates"
                                                                                    : "blend";
  std::string text = fmt::format("{}{}, width {}", kind, sparse, number(candidate.validity.width, 3));
  text += candidate.jump < no_jump ? fmt::format(", jumps from {}", number(candidate.jump, 3)) : "";
  text += candidate.estimation == Estimation::as_grown ? ", as grown"
          : candidate.estimation == Estimation::local  ? ", local"
                                                       : fmt::format(", ridge {}", candidate.ridge);
  return candidate.shrinkage > 0.0 ? text + fmt::format(", shrinkage {}", candidate.shrinkage) : text;
}

Json candidate_json(const CandidateError& entry) {
  const auto or_null = [](double value) { return std::isnan(value) ? Json(nullptr) : Json(value); };
  return {{"validity", name_of(entry.candidate.validity.kind)},
          {"width", entry.candidate.validity.width},
          {"jump", entry.candidate.jump < no_jump ? Json(entry.candidate.jump) : Json(nullptr)},
          {"estimation", name_of(entry.candidate.estimation)},
          {"ridge", entry.candidate.ridge},
          {"shrinkage", entry.candidate.shrinkage},
          {"sparse", entry.candidate.sparse},
          {"leaves", entry.candidate.leaves},
          {"local_models", entry.candidate.leaves},
          {"cv_rmse", or_null(entry.rmse)},
          {"spread", or_null(entry.spread)}};
}

double least_squares_rmse(const PartitionSummary& partition) {
  return partition.best_of_kind.empty() ? std::nan("") : partition.best_of_kind.front().rmse;
}

// How the held-out rows came to be.
std::string selection_text(const FitRun& run, const PartitionSummary& partition) {
  if (partition.cv_folds == 0) return "no held-out rows: the tree stays as grown";
  if (partition.cv_folds == 1) {
    return fmt::format("chosen on {} rows held out once", partition.held_out_rows);
  }
  return fmt::format("chosen by {}-fold cross-validation{}, the tree grown anew in every fold", partition.cv_folds,
                     run.learning.contiguous ? " over contiguous blocks of rows" : "");
}

// What the local models are made of, and what spoke for it; nothing for what was not asked.
std::string local_models_text(const FitRun& run, const FitSummary& summary) {
  const FitOptions& asked = run.learning.options;
  std::string text;
  if (asked.terms != LocalTerms::linear) {
    text += fmt::format("Local models are {}", summary.quadratic ? "quadratic" : "linear");
    for (std::size_t p = 0; p < summary.other_terms.size(); ++p) {
      text += fmt::format("{} RMSE held-out {}",
                          p == 0 ? fmt::format("; {} ones:", summary.quadratic ? "linear" : "quadratic") : ",",
                          number(summary.other_terms[p].rmse));
    }
    text += asked.terms == LocalTerms::automatic && summary.other_terms.empty()
                ? ", without a comparison: it needs folds and 1 to 13 numeric regression inputs.\n"
                : ".\n";
  }
  for (const PartitionSummary& partition : summary.partitions) {
    if (partition.chosen.candidate.sparse) {
      text +=
          fmt::format("Sparse local models: {} coefficients in {} leaves.\n", partition.coefficients, partition.leaves);
    }
  }
  return text;
}

std::vector<std::string> names_of(const Model& model, const std::vector<int>& inputs) {
  std::vector<std::string> names;
  for (const int input : inputs) names.push_back(model.inputs()[input].name);
  return names;
}

// Which inputs the partitions do not use, and what that gained; nothing for those that use all.
std::string left_out_text(const FitResult& result) {
  std::string text;
  for (const PartitionSummary& partition : result.summary.partitions) {
    if (partition.left_out.empty()) continue;
    const std::vector<InputStep>& steps = partition.input_steps;
    const auto kept = result.model.num_inputs() - std::ssize(partition.left_out);
    const auto chosen = std::ranges::find(steps, kept, &InputStep::inputs);
    const std::string target = result.summary.partitions.size() == 1
                                   ? ""
                                   : fmt::format(" of {}", result.model.outputs()[partition.outputs[0]].name);
    text += fmt::format(
        "Inputs left out{}: {} of {} ({}); in a quick comparison held-out RMSE was {} with all inputs, {} without "
        "these.\n",
        target, partition.left_out.size(), result.model.num_inputs(),
        fmt::join(names_of(result.model, partition.left_out), ", "), number(steps.front().rmse), number(chosen->rmse));
  }
  return text;
}

// Which inputs are codes, and what that gained; nothing if none is.
std::string codes_text(const FitResult& result) {
  const CodeChoice& codes = result.summary.codes;
  if (codes.taken.empty()) return "";
  return fmt::format(
      "Numbers taken for codes, that is for categories: {}; in a quick comparison held-out RMSE was {}{} as numbers, "
      "{} "
      "as codes.\n",
      fmt::join(names_of(result.model, codes.taken), ", "), result.summary.partitions.size() > 1 ? "relative, " : "",
      number(codes.rmse_as_numbers), number(codes.rmse_as_codes));
}

// Of the outputs that are clamped, between what, and what that gained.
std::string range_text(const Model& model, const PartitionSummary& summary, const Partition& partition) {
  std::string text;
  for (std::size_t o = 0; o < summary.range_guards.size(); ++o) {
    if (const RangeGuard& guard = summary.range_guards[o]; guard.taken) {
      text += fmt::format("{} is kept between {} and {}, the range of the training rows: RMSE held-out {} -> {}.\n",
                          model.outputs()[summary.outputs[o]].name,
                          number(partition.output_range(static_cast<Eigen::Index>(o), 0)),
                          number(partition.output_range(static_cast<Eigen::Index>(o), 1)), number(guard.rmse_without),
                          number(guard.rmse_with));
    }
  }
  return text;
}

// How the splits of the final tree were searched; nothing if there were none to search.
std::string search_text(const SearchSummary& search) {
  if (search.binned_nodes == 0) {
    return search.exact_nodes == 0 || search.evaluations == 0 ? "" : "Every possible split was compared.\n";
  }
  return fmt::format(
      "Splits searched by bins in {} nodes, exactly in {} small ones. {}\n", search.binned_nodes, search.exact_nodes,
      search.largest_excess > 0.0
          ? fmt::format("A better split may exist by at most {} % of a node's residual sum of squares; --search exact "
                        "looks for it.",
                        number(100.0 * search.largest_excess, 2))
          : "There are no better ones.");
}

// Counted from 1.
std::vector<Eigen::Index> rows_without_weight(const FitSummary& summary) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < summary.loss_weights.size(); ++row) {
    if (summary.loss_weights(row) == 0.0) rows.push_back(row + 1);
  }
  return rows;
}

void print_data(const FitRun& run, const FitResult& result) {
  std::vector<std::string> inputs;
  std::vector<std::string> constant;
  for (const InputColumn& input : result.model.inputs()) {
    inputs.push_back(input.is_categorical() ? fmt::format("{} ({} categories)", input.name, input.levels.size())
                                            : input.name);
    if (input.low == input.high) {
      constant.push_back(input.name);
    }
  }
  print(fmt::format("{}: {} rows, {} inputs: {}\n", table_name(run.learning.data), result.summary.samples,
                    inputs.size(), fmt::join(inputs, ", ")));
  if (result.summary.repeats) {
    print("Rows with equal inputs are taken for repeats of one measurement, and are held out together\n");
  }
  if (result.summary.copies > 0) {
    print(fmt::format("Copies of other rows: {}; they only add to the weight of the rows that they copy\n",
                      result.summary.copies));
  }
  if (result.summary.missing_values > 0) {
    print(fmt::format("Missing values in the inputs: {}\n", result.summary.missing_values));
  }
  if (run.learning.options.loss == Loss::tukey) {
    const std::vector<Eigen::Index> rows = rows_without_weight(result.summary);
    print(fmt::format(
        "Rows left out by the Tukey loss: {} of {}{}\n", rows.size(), result.summary.loss_weights.size(),
        rows.empty()
            ? ""
            : fmt::format(" (row {}{})", fmt::join(std::span(rows).first(std::min<std::size_t>(rows.size(), 10)), ", "),
                          rows.size() > 10 ? ", ..." : "")));
  }
  if (!constant.empty()) {
    print(fmt::format("Constant, so without influence: {}\n", fmt::join(constant, ", ")));
  }
}

bool is_same_but_for_ridge(const Candidate& a, const Candidate& b) {
  return a.validity.kind == b.validity.kind && a.validity.width == b.validity.width && a.jump == b.jump &&
         a.leaves == b.leaves;
}

// The chosen model of every target, and below it what it was chosen against.
Table models_table(const FitResult& result) {
  Table table({"target", "model", "leaves", "RMSE held-out", "+-", "RMSE in-sample"});
  for (const PartitionSummary& partition : result.summary.partitions) {
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      const std::string& target = result.model.outputs()[partition.outputs[o]].name;
      table.add({target, describe(partition.chosen.candidate), fmt::format("{}", partition.leaves),
                 number(partition.chosen.rmse), number(partition.chosen.spread, 2), number(partition.train_rmse(o))});
      if (o > 0) continue;
      const Candidate& chosen = partition.chosen.candidate;
      for (const CandidateError& other : partition.best_of_kind) {
        const Candidate& candidate = other.candidate;
        if (!is_same_but_for_ridge(candidate, chosen)) {
          table.add({"  against", describe(candidate), fmt::format("{}", candidate.leaves), number(other.rmse),
                     number(other.spread, 2), ""});
        }
      }
    }
  }
  return table;
}

}  // namespace

Json summary_json(const FitRun& run, const FitResult& result) {
  Json json;
  json["data"] = run.learning.data;
  json["rows"] = result.summary.samples;
  json["copies"] = result.summary.copies;
  json["repeats"] = result.summary.repeats;
  json["missing_values"] = result.summary.missing_values;
  json["rule"] = name_of(run.learning.options.rule);
  json["min_leaf_samples"] = result.summary.min_leaf_samples;
  if (run.learning.options.loss == Loss::tukey) json["rows_left_out"] = rows_without_weight(result.summary);
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
    entry["range_guards"] = Json::array();  // one a target
    for (const RangeGuard& guard : partition.range_guards) {
      entry["range_guards"].push_back(
          {{"taken", guard.taken}, {"cv_rmse_without", guard.rmse_without}, {"cv_rmse_with", guard.rmse_with}});
    }
    entry["cv_rmse_least_squares"] = judged ? Json(least_squares_rmse(partition)) : Json(nullptr);
    entry["crisp_cv_rmse_by_leaves"] =
        std::vector<double>(partition.crisp_cv_rmse.begin(), partition.crisp_cv_rmse.end());
    if (!result.summary.other_terms.empty()) {
      entry["other_terms"] = candidate_json(result.summary.other_terms[json["partitions"].size()]);
    }
    json["partitions"].push_back(std::move(entry));
  }
  json["model"] = run.output.empty() ? Json(nullptr) : Json(run.output);
  return json;
}

void print_summary(const FitRun& run, const FitResult& result) {
  print_data(run, result);
  print(fmt::format("Tree grown by method {}, at least {} rows in a leaf; {}\n\n", name_of(run.learning.options.rule),
                    result.summary.min_leaf_samples, selection_text(run, result.summary.partitions.front())));
  print(models_table(result).text());
  for (const PartitionSummary& partition : result.summary.partitions) {
    const double chosen = partition.chosen.rmse;
    const auto is_better = [&](const CandidateError& other) { return other.rmse < chosen; };
    if (std::ranges::none_of(partition.best_of_kind, is_better)) continue;
    print("A model with a smaller error is not better by more than chance; the simpler one was taken.\n");
    break;
  }
  if (result.summary.partitions.front().outputs.size() > 1) {
    print("Held-out errors of the shared tree are over all targets, each divided by its standard deviation.\n");
  }
  print(codes_text(result));
  print(left_out_text(result));
  for (std::size_t p = 0; p < result.summary.partitions.size(); ++p) {
    print(range_text(result.model, result.summary.partitions[p], result.model.partitions()[p]));
  }
  print(local_models_text(run, result.summary));
  for (const PartitionSummary& partition : result.summary.partitions) {
    print(search_text(partition.search));
    // M5' drops inputs on its own; its leaves keep nothing of their parent's but what smoothing gives them.
    if (partition.rank_deficient_leaves > 0 && !has_own_models(run.learning.options.rule)) {
      print(
          fmt::format("In {} leaves the rows did not determine every slope; such slopes are those of the leaf's "
                      "parent. That does no "
                      "harm within the range of the rows.\n",
                      partition.rank_deficient_leaves));
    }
  }
  if (!run.output.empty()) {
    print(fmt::format("Model written to {}\n", run.output));
  }
}

}  // namespace llmt::apps
