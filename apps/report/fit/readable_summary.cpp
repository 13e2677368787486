#include "report/fit/readable_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "llmt/size.hpp"
#include "report/fit/fit_summary.hpp"

namespace llmt::report {
namespace {

// The part of a model that serves one partition.
Model part_of(const Model& model, std::size_t p) {
  Partition partition = model.partitions()[p];
  std::vector<OutputColumn> outputs;
  for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
    outputs.push_back(model.outputs()[partition.outputs[o]]);
    partition.outputs[o] = static_cast<int>(o);
  }
  return {model.inputs(), outputs, model.regressors(), {partition}};
}

Eigen::Index most_terms(const Partition& partition) {
  Eigen::Index most = 0;
  for (const Node& node : partition.nodes) {
    Eigen::Index terms = 0;
    for (Eigen::Index k = 0; node.is_leaf() && k < node.slope.cols(); ++k)
      terms += node.slope.col(k).isZero(0.0) ? 0 : 1;
    most = std::max(most, terms);
  }
  return most;
}

// Rules that a person reads.
constexpr Eigen::Index most_read_rules = 12;

double smallest_crisp(const PartitionSummary& full) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const CandidateError& error : full.best_of_kind) {
    if (error.candidate.validity.kind == ValidityKind::crisp) smallest = std::min(smallest, error.rmse);
  }
  return smallest;
}

// How the readable tree was chosen. `of`: " of TARGET" where there are several.
std::string note_on(const ReadablePartition& simple, const PartitionSummary& full, const std::string& of,
                    const ReadableOptions& asked) {
  if (asked.rules > 0) {
    const std::string none = simple.leaves == asked.rules
                                 ? ""
                                 : fmt::format("; no step has {}, or those that have pay with nothing", asked.rules);
    return fmt::format("The readable tree{} is the step with at most {} rule{}, as asked{}.", of, asked.rules,
                       asked.rules == 1 ? "" : "s", none);
  }
  const std::string best = number(simple.yardstick);
  const std::string whose =
      simple.yardstick < smallest_crisp(full) ? "the smallest error of such trees" : "the error of the best crisp tree";
  if (simple.is_within_loss) {
    return fmt::format("When it was chosen the readable tree{} was the smallest one at most {:g} % above {}, {}.", of,
                       100.0 * asked.loss, best, whose);
  }
  return fmt::format("No short tree{} came within {:g} % of {}, {}; this one came nearest.", of, 100.0 * asked.loss,
                     best, whose);
}

double per_cent_above(double rmse, double of_model) { return 100.0 * (rmse / of_model - 1.0); }

// What reading costs beside the model that was chosen: "Reading costs 32 % more error (over the folds 26 to 41 %):
// ...".
std::string price_of(const ReadablePartition& simple, const CandidateError& chosen, const std::string& of) {
  if (!(chosen.rmse > 0.0)) return "";
  const double cost = per_cent_above(simple.rmse, chosen.rmse);
  if (cost < 0.0) {
    return fmt::format("The readable tree{} has a smaller held-out error than the model chosen above.", of);
  }
  std::string spread;
  if (simple.fold_rmse.size() > 1 && simple.fold_rmse.size() == chosen.fold_rmse.size() &&
      (chosen.fold_rmse.array() > 0.0).all()) {
    const Eigen::ArrayXd of_folds = 100.0 * (simple.fold_rmse.array() / chosen.fold_rmse.array() - 1.0);
    spread = fmt::format(" (over the folds {:.0f} to {:.0f} %)", of_folds.minCoeff(), of_folds.maxCoeff());
  }
  return fmt::format("Reading{} costs {:.0f} % more error{}: RMSE held-out {} in the place of {}.", of, cost, spread,
                     number(simple.rmse), number(chosen.rmse));
}

// What a person should know of the choice, in sentences.
std::vector<std::string> sentences_on(const FitResult& fitted, const ReadableResult& readable, std::size_t p,
                                      const ReadableOptions& asked) {
  const ReadablePartition& simple = readable.partitions[p];
  const PartitionSummary& full = fitted.summary.partitions[p];
  const std::string of =
      readable.partitions.size() > 1 ? " of " + fitted.model.outputs()[simple.outputs.front()].name : "";
  std::vector<std::string> sentences;
  if (std::string price = price_of(simple, full.chosen, of); !price.empty()) sentences.push_back(std::move(price));
  if (simple.leaves > most_read_rules) {
    sentences.push_back(
        fmt::format("{} rules are more than a person reads: no short tree{} is near.", simple.leaves, of));
  }
  if (simple.rmse > full.best_of_kind.front().rmse) {
    sentences.push_back(fmt::format("Least squares{} of all inputs has a smaller error.", of));
  }
  sentences.push_back(note_on(simple, full, of, asked));
  return sentences;
}

// Steps that are shown: those that a person reads, the one that is taken, and the last.
std::vector<std::size_t> shown_steps(const ReadablePartition& simple) {
  std::vector<std::size_t> shown;
  for (std::size_t k = 0; k < simple.path.size(); ++k) {
    if (simple.path[k].leaves <= most_read_rules || k == simple.taken || k + 1 == simple.path.size())
      shown.push_back(k);
  }
  return shown;
}

std::string count(Eigen::Index value) { return fmt::format("{}", value); }

Json step_json(const ReadableStep& step, const CandidateError& chosen) {
  Json json;
  json["leaves"] = step.leaves;
  json["most_terms"] = step.most_terms;
  json["size"] = step.size;
  json["cv_rmse"] = step.rmse;
  json["spread"] = step.spread;
  json["above_model"] = chosen.rmse > 0.0 ? Json(step.rmse / chosen.rmse - 1.0) : Json();
  return json;
}

Grid steps_grid(const FitResult& fitted, const ReadableResult& readable) {
  Grid grid{.header = {"target", "rules", "terms per rule", "size", "RMSE held-out", "above the model", ""},
            .rows = {},
            .words = {6},
            .wide = true};
  for (std::size_t p = 0; p < readable.partitions.size(); ++p) {
    const ReadablePartition& simple = readable.partitions[p];
    const double chosen = fitted.summary.partitions[p].chosen.rmse;
    std::string name = fitted.model.outputs()[simple.outputs.front()].name;
    for (const std::size_t k : shown_steps(simple)) {
      const ReadableStep& step = simple.path[k];
      // Adding 0 leaves no "-0".
      const double per_cent = std::round(per_cent_above(step.rmse, chosen)) + 0.0;
      const std::string above = chosen > 0.0 ? fmt::format("{:.0f} %", per_cent) : "";
      grid.rows.push_back({name, count(step.leaves), count(step.most_terms), count(step.size), number(step.rmse), above,
                           k == simple.taken ? "taken" : ""});
      name.clear();
    }
  }
  return grid;
}

}  // namespace

Json readable_json(const FitResult& fitted, const ReadableResult& readable, const ReadableOptions& asked) {
  Json json = Json::array();
  for (std::size_t p = 0; p < readable.partitions.size(); ++p) {
    const ReadablePartition& partition = readable.partitions[p];
    const CandidateError& chosen = fitted.summary.partitions[p].chosen;
    Json entry;
    for (const int output : partition.outputs) entry["targets"].push_back(readable.model.outputs()[output].name);
    entry["leaves"] = partition.leaves;
    entry["most_terms"] = partition.most_terms;
    entry["inputs"] = partition.used_inputs;
    entry["size"] = partition.size;
    entry["cv_rmse"] = partition.rmse;
    entry["spread"] = partition.spread;
    entry["yardstick_cv_rmse"] = partition.yardstick;
    entry["is_within_loss"] = partition.is_within_loss;
    entry["taken"] = partition.taken;
    entry["path"] = Json::array();
    for (const ReadableStep& step : partition.path) entry["path"].push_back(step_json(step, chosen));
    entry["sentences"] = sentences_on(fitted, readable, p, asked);
    json.push_back(std::move(entry));
  }
  return json;
}

Section readable_words(const FitResult& fitted, const ReadableResult& readable, const ReadableOptions& asked) {
  Grid table{.header = {"target", "model", "leaves", "terms per leaf", "size", "RMSE held-out", "spread of folds"},
             .rows = {},
             .words = {1},
             .wide = true};
  std::vector<std::string> notes = {
      "Size: operators, constants and variables of the model as an expression. Errors of readable trees are of rows on "
      "which they were not chosen. --readable-rules N takes another step."};
  for (std::size_t p = 0; p < readable.partitions.size(); ++p) {
    const ReadablePartition& simple = readable.partitions[p];
    const PartitionSummary& full = fitted.summary.partitions[p];
    const Model whole = part_of(fitted.model, p);
    const std::string& target = fitted.model.outputs()[simple.outputs.front()].name;
    const auto add = [&](const std::string& name, const std::string& model, Eigen::Index leaves, Eigen::Index terms,
                         Eigen::Index size, double rmse, double spread) {
      table.rows.push_back(
          {name, model, count(leaves), count(terms), count(size), number(rmse), spread_text(spread, full.cv_folds)});
    };
    add(target, "as chosen above", full.leaves, most_terms(whole.partitions()[0]), expression_size(whole),
        full.chosen.rmse, full.chosen.spread);
    add("", "readable", simple.leaves, simple.most_terms, simple.size, simple.rmse, simple.spread);
    const CandidateError& linear = full.best_of_kind.front();
    const Model root = whole.prefix(1);
    add("", "least squares", 1, most_terms(root.partitions()[0]), expression_size(root), linear.rmse, linear.spread);
    for (std::string& sentence : sentences_on(fitted, readable, p, asked)) notes.push_back(std::move(sentence));
  }
  return {"What reading costs", "", {block(table), block(steps_grid(fitted, readable)), text_block("", notes)}};
}

}  // namespace llmt::report
