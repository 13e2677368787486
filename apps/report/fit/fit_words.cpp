#include "report/fit/fit_summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "report/fit/kinds.hpp"
#include "report/fit/mean_of_rows.hpp"

namespace llmt::report {
namespace {

using Lines = std::vector<std::string>;

// "RD (the default)".
std::string title_with_default(GrowthRule rule) {
  return std::string(title_of(rule)) + (rule == FitOptions().rule ? " (the default)" : "");
}

// How the held-out rows came to be.
std::string selection_text(const FitRun& run, const PartitionSummary& partition) {
  if (partition.cv_folds == 0) {
    const bool is_one_group = run.options.folds.count > 0 && !run.rows.groups.empty();
    return fmt::format("no held-out rows{}: the tree stays as grown",
                       is_one_group ? ", because all rows are of one group" : "");
  }
  if (partition.cv_folds == 1) {
    return fmt::format("chosen on {} rows held out once", partition.held_out_rows);
  }
  return fmt::format("chosen by {}-fold cross-validation{}{}, the tree grown anew in every fold", partition.cv_folds,
                     run.options.folds.kind == FoldKind::contiguous ? " over contiguous blocks of rows" : "",
                     run.rows.groups.empty() ? "" : " that keeps groups together");
}

// What the local models are made of, and what spoke for it; nothing for what was not asked.
void add_local_models(const FitRun& run, const FitSummary& summary, Lines& lines) {
  const FitOptions& asked = run.options;
  if (asked.terms != LocalTerms::linear) {
    std::string text = fmt::format("Local models are {}", summary.quadratic ? "quadratic" : "linear");
    for (std::size_t p = 0; p < summary.other_terms.size(); ++p) {
      text += fmt::format("{} RMSE held-out {}",
                          p == 0 ? fmt::format("; {} ones:", summary.quadratic ? "linear" : "quadratic") : ",",
                          number(summary.other_terms[p].rmse));
    }
    lines.push_back(text + (asked.terms == LocalTerms::automatic && summary.other_terms.empty()
                                ? ", without a comparison: it needs folds and 1 to 13 numeric regression inputs."
                                : "."));
  }
  for (const PartitionSummary& partition : summary.partitions) {
    if (!partition.chosen.candidate.sparse) continue;
    lines.push_back(
        fmt::format("Sparse local models: {} coefficients in {} leaves.", partition.coefficients, partition.leaves));
  }
}

// Which inputs the partitions do not use, and what that gained; nothing for those that use all.
void add_left_out(const FitResult& result, Lines& lines) {
  for (const PartitionSummary& partition : result.summary.partitions) {
    if (partition.left_out.empty()) continue;
    const std::vector<InputStep>& steps = partition.input_steps;
    const auto kept = result.model.num_inputs() - std::ssize(partition.left_out);
    const auto chosen = std::ranges::find(steps, kept, &InputStep::inputs);
    const std::string target = result.summary.partitions.size() == 1
                                   ? ""
                                   : fmt::format(" of {}", result.model.outputs()[partition.outputs[0]].name);
    lines.push_back(fmt::format(
        "Inputs left out{}: {} of {} ({}); in a quick comparison held-out RMSE was {} with all inputs, {} without "
        "these.",
        target, partition.left_out.size(), result.model.num_inputs(),
        first_names(names_of(result.model, partition.left_out)), number(steps.front().rmse), number(chosen->rmse)));
  }
}

// Which inputs are codes, and what that gained; nothing if none is.
void add_codes(const FitResult& result, Lines& lines) {
  const CodeChoice& codes = result.summary.codes;
  if (codes.taken.empty()) return;
  lines.push_back(fmt::format(
      "Numbers taken for codes, that is for categories: {}; in a quick comparison held-out RMSE was {}{} as numbers, "
      "{} as codes.",
      fmt::join(names_of(result.model, codes.taken), ", "), result.summary.partitions.size() > 1 ? "relative, " : "",
      number(codes.rmse_as_numbers), number(codes.rmse_as_codes)));
}

// Of the outputs that are clamped, between what, and what that gained.
void add_ranges(const Model& model, const PartitionSummary& summary, const Partition& partition, Lines& lines) {
  for (std::size_t o = 0; o < summary.range_guards.size(); ++o) {
    const RangeGuard& guard = summary.range_guards[o];
    if (!guard.taken) continue;
    const auto bound = [&](Eigen::Index side) {
      return number(partition.output_range(static_cast<Eigen::Index>(o), side));
    };
    lines.push_back(fmt::format("{} is kept between {} and {}, the range of the training rows: RMSE held-out {} -> {}.",
                                model.outputs()[summary.outputs[o]].name, bound(0), bound(1),
                                number(guard.rmse_without), number(guard.rmse_with)));
  }
}

// How the splits of the final tree were searched, if not all were compared.
void add_search(const SearchSummary& search, Lines& lines) {
  if (search.binned_nodes == 0) return;
  lines.push_back(fmt::format(
      "Thresholds of splits: in {} node{} of many rows the best one between groups of neighbouring values, in {} small "
      "one{} the best of all. {}",
      search.binned_nodes, search.binned_nodes == 1 ? "" : "s", search.exact_nodes, search.exact_nodes == 1 ? "" : "s",
      search.largest_excess > 0.0
          ? fmt::format("A threshold within a group would lower a node's sum of squared errors by at most {} % more; "
                        "--search exact looks for it.",
                        number(100.0 * search.largest_excess, 2))
          : "No threshold within a group is better."));
}

// What rows with equal inputs say of the held-out error; nothing if there are hardly any.
void add_equal_rows(const FitResult& result, Lines& notes) {
  constexpr Eigen::Index fewest = 10;  // fewer rows say nothing of an error
  for (const PartitionSummary& partition : result.summary.partitions) {
    if (!partition.equal_rows) continue;
    const EqualRowErrors& errors = *partition.equal_rows;
    const bool repeats = result.summary.repeats;
    if (!repeats && std::min(errors.rows_new, errors.rows_known) < fewest) continue;
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      const auto at = static_cast<Eigen::Index>(o);
      const std::string of_target = result.model.num_outputs() == 1
                                        ? ""
                                        : fmt::format(" of {}", result.model.outputs()[partition.outputs[o]].name);
      notes.push_back(
          repeats
              ? fmt::format("Rows with equal inputs are taken for repeats of one setting and held out together: RMSE "
                            "held-out{} {} is for new settings; repeats of a setting differ by {}",
                            of_target, number(errors.rmse_new(at)), number(errors.rmse_known(at)))
              : fmt::format("RMSE held-out{}: {} for the {} rows with inputs that no training row has, {} for the "
                            "other {}",
                            of_target, number(errors.rmse_new(at)), errors.rows_new, number(errors.rmse_known(at)),
                            errors.rows_known));
    }
  }
}

// " (country 139, age 2)": the inputs with missing values, those with most of them first.
std::string columns_with_missing(const FitRun& run, const Model& model) {
  std::vector<std::pair<Eigen::Index, std::string>> columns;
  for (Eigen::Index j = 0; j < run.rows.inputs.cols(); ++j) {
    const Eigen::Index count = run.rows.inputs.col(j).array().isNaN().count();
    if (count > 0) columns.emplace_back(-count, fmt::format("{} {}", model.inputs()[j].name, count));
  }
  if (columns.empty()) return "";
  std::ranges::stable_sort(columns, {}, &std::pair<Eigen::Index, std::string>::first);
  std::vector<std::string> names;
  for (auto& [count, name] : columns) names.push_back(std::move(name));
  return fmt::format(" ({})", first_names(names));
}

// What was read, and what is to be known of its rows.
void add_data(const FitRun& run, const FitResult& result, Document& words) {
  std::vector<std::string> inputs;
  std::vector<std::string> constant;
  for (const InputColumn& input : result.model.inputs()) {
    inputs.push_back(input.is_categorical() ? fmt::format("{} ({} categories)", input.name, input.levels.size())
                                            : input.name);
    if (input.low == input.high) {
      constant.push_back(input.name);
    }
  }
  words.subject = fmt::format("{}: {} rows, {} input{}: {}", run.data, result.summary.samples, inputs.size(),
                              inputs.size() == 1 ? "" : "s", first_names(inputs));
  add_equal_rows(result, words.notes);
  if (result.summary.copies > 0) {
    words.notes.push_back(fmt::format(
        "Copies of other rows: {}; they only add to the weight of the rows that they copy", result.summary.copies));
  }
  if (result.summary.missing_values > 0) {
    words.notes.push_back(fmt::format("Missing values in the inputs: {}{}", result.summary.missing_values,
                                      columns_with_missing(run, result.model)));
  }
  if (run.options.loss == Loss::tukey) {
    const std::vector<Eigen::Index> rows = rows_left_out(result.summary.loss_weights, run.rows.weights);
    const auto lacks_input = [&](Eigen::Index row) { return run.rows.inputs.row(row).hasNaN(); };
    const auto lacking = std::ranges::count_if(rows, lacks_input);
    words.notes.push_back(left_out_by_loss(lines_at(run.lines, rows), result.summary.samples + std::ssize(rows)));
    if (2 * lacking > std::ssize(rows)) {
      words.notes.push_back(fmt::format(
          "{} of these have empty cells in inputs: the errors below, and intervals, hold for rows without empty cells",
          lacking));
    }
  }
  if (!constant.empty()) {
    words.notes.push_back(fmt::format("Constant, so without influence: {}", first_names(constant)));
  }
}

// The chosen model of every target, below it the best of the other kinds, and the mean of the rows.
Json models_table(const FitRun& run, const FitResult& result) {
  Grid table{.header = {"target", "model", "leaves", "RMSE held-out", "spread of folds", "RMSE in-sample"},
             .rows = {},
             .words = {1},
             .wide = true};
  for (const PartitionSummary& partition : result.summary.partitions) {
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      const std::string& target = result.model.outputs()[partition.outputs[o]].name;
      const CandidateError& chosen = partition.chosen;
      table.rows.push_back({target, kind_of(chosen.candidate), fmt::format("{}", partition.leaves), number(chosen.rmse),
                            spread_text(chosen.spread, partition.cv_folds), number(partition.train_rmse(o))});
      if (o > 0) continue;
      const std::vector<CandidateError> kinds = best_of_kinds(partition);
      for (const CandidateError& other : std::span(kinds).subspan(1)) {
        table.rows.push_back({"  against", kind_of(other.candidate), fmt::format("{}", other.candidate.leaves),
                              number(other.rmse), spread_text(other.spread, partition.cv_folds), ""});
      }
      if (partition.outputs.size() > 1) continue;  // whose errors are relative
      const ErrorOfMean mean = error_of_mean(run, result, partition.outputs[o]);
      table.rows.push_back({"  against", mean_of_rows, "", std::isnan(mean.rmse) ? "-" : number(mean.rmse),
                            spread_text(mean.spread, partition.cv_folds), number(mean.train)});
    }
  }
  return block(table);
}

}  // namespace

std::vector<Eigen::Index> rows_left_out(const Eigen::VectorXd& loss_weights, const Eigen::VectorXd& weights) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < loss_weights.size(); ++row) {
    if (loss_weights(row) == 0.0 && (weights.size() == 0 || weights(row) > 0.0)) rows.push_back(row);
  }
  return rows;
}

std::string left_out_by_loss(std::vector<Eigen::Index> lines, Eigen::Index rows) {
  constexpr std::size_t most_named = 10;
  const std::size_t count = lines.size();
  std::string text = fmt::format("Rows left out by the Tukey loss: {} of {}", count, rows);
  if (count == 0) return text;
  lines.resize(std::min(count, most_named));
  return text + fmt::format(" ({} {}{}); the errors below are those of the other rows", count == 1 ? "line" : "lines",
                            fmt::join(lines, ", "), count > lines.size() ? ", ..." : "");
}

std::string spread_text(double spread, Eigen::Index folds) { return folds > 1 ? number(spread, 2) : "-"; }

std::vector<Eigen::Index> counted_from_one(std::vector<Eigen::Index> rows) {
  for (Eigen::Index& row : rows) ++row;
  return rows;
}

std::vector<std::string> names_of(const Model& model, const std::vector<int>& inputs) {
  std::vector<std::string> names;
  for (const int input : inputs) names.push_back(model.inputs()[input].name);
  return names;
}

std::vector<Eigen::Index> lines_at(const std::vector<Eigen::Index>& lines, const std::vector<Eigen::Index>& rows) {
  std::vector<Eigen::Index> chosen;
  for (const Eigen::Index row : rows) chosen.push_back(lines[row]);
  return chosen;
}

Document fit_words(const FitRun& run, const FitResult& result) {
  const std::vector<PartitionSummary>& partitions = result.summary.partitions;
  Document words{.title = "", .answer = ""};
  add_data(run, result, words);
  words.notes.push_back(fmt::format("Tree grown by {}, at least {} rows in a leaf; {}",
                                    title_with_default(run.options.rule), result.summary.min_leaf_samples,
                                    selection_text(run, partitions.front())));
  Lines lines;
  const auto has_better = [](const PartitionSummary& partition) {
    return std::ranges::any_of(best_of_kinds(partition),
                               [&](const CandidateError& other) { return other.rmse < partition.chosen.rmse; });
  };
  if (std::ranges::any_of(partitions, has_better)) {
    lines.push_back("A model with a smaller error is not better by more than chance; the simpler one was taken.");
  }
  if (partitions.front().outputs.size() > 1) {
    lines.push_back("Held-out errors of the shared tree are over all targets, each divided by its standard deviation.");
  }
  add_codes(result, lines);
  add_left_out(result, lines);
  for (std::size_t p = 0; p < partitions.size(); ++p) {
    add_ranges(result.model, partitions[p], result.model.partitions()[p], lines);
  }
  add_local_models(run, result.summary, lines);
  for (const PartitionSummary& partition : partitions) add_search(partition.search, lines);
  if (!run.output.empty()) lines.push_back(fmt::format("Model written to {}", run.output));
  words.sections.push_back({"What was compared", "", {models_table(run, result)}});
  if (!lines.empty()) words.sections.back().blocks.push_back(text_block("", lines));
  return words;
}

}  // namespace llmt::report
