#include "report/fit/readable_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

// How the readable tree was chosen. `of`: " of TARGET" where there are several.
std::string note_on(const ReadablePartition& simple, const std::string& of, double loss) {
  const std::string best = number(simple.best_crisp);
  if (simple.is_within_loss) {
    return fmt::format(
        "The readable tree{} is the smallest one whose held-out RMSE is at most {:g} % above that of the best crisp "
        "tree of any form, unrounded and short ones included ({}).",
        of, 100.0 * loss, best);
  }
  const std::string none = fmt::format("No short tree{} came within {:g} % of {}", of, 100.0 * loss, best);
  const double above = 100.0 * (simple.rmse / simple.best_crisp - 1.0);
  return std::isfinite(above) ? fmt::format("{}; this one is {} % above.", none, number(above, above < 100.0 ? 2 : 3))
                              : fmt::format("{}; this one has {}.", none, number(simple.rmse));
}

// What reading costs beside the model that was chosen: "Reading costs 32 % more error (over the folds 26 to 41 %):
// ...".
std::string price_of(const ReadablePartition& simple, const CandidateError& chosen, const std::string& of) {
  if (!(chosen.rmse > 0.0)) return "";
  const double cost = 100.0 * (simple.rmse / chosen.rmse - 1.0);
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

constexpr Eigen::Index most_read_rules = 12;

std::string count(Eigen::Index value) { return fmt::format("{}", value); }

}  // namespace

Json readable_json(const ReadableResult& readable) {
  Json json = Json::array();
  for (const ReadablePartition& partition : readable.partitions) {
    Json entry;
    for (const int output : partition.outputs) entry["targets"].push_back(readable.model.outputs()[output].name);
    entry["leaves"] = partition.leaves;
    entry["most_terms"] = partition.most_terms;
    entry["inputs"] = partition.used_inputs;
    entry["size"] = partition.size;
    entry["cv_rmse"] = partition.rmse;
    entry["spread"] = partition.spread;
    entry["best_crisp_cv_rmse"] = partition.best_crisp;
    entry["is_within_loss"] = partition.is_within_loss;
    json.push_back(std::move(entry));
  }
  return json;
}

Section readable_words(const FitResult& fitted, const ReadableResult& readable, double loss) {
  Grid table{.header = {"target", "model", "leaves", "terms per leaf", "size", "RMSE held-out", "spread of folds"},
             .rows = {},
             .words = {1},
             .wide = true};
  std::vector<std::string> notes = {"Size: operators, constants and variables of the model as an expression."};
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
    const std::string of = readable.partitions.size() > 1 ? " of " + target : "";
    if (std::string price = price_of(simple, full.chosen, of); !price.empty()) notes.push_back(std::move(price));
    if (simple.leaves > most_read_rules) {
      notes.push_back(
          fmt::format("{} rules are more than a person reads: no short tree{} is near.", simple.leaves, of));
    }
    if (simple.rmse > linear.rmse) {
      notes.push_back(fmt::format("Least squares{} has a smaller error, and is shorter: read that.", of));
    }
    notes.push_back(note_on(simple, of, loss));
  }
  return {"What reading costs", "", {block(table), text_block("", notes)}};
}

}  // namespace llmt::report
