#include "report/fit/readable_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "llmt/size.hpp"

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
        "tree ({}).\n",
        of, 100.0 * loss, best);
  }
  const std::string none = fmt::format("No short tree{} came within {:g} % of {}", of, 100.0 * loss, best);
  const double above = 100.0 * (simple.rmse / simple.best_crisp - 1.0);
  return std::isfinite(above) ? fmt::format("{}; this one is {} % above.\n", none, number(above, above < 100.0 ? 2 : 3))
                              : fmt::format("{}; this one has {}.\n", none, number(simple.rmse));
}

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

std::string readable_text(const FitResult& fitted, const ReadableResult& readable, double loss, std::size_t width) {
  Table table({"target", "model", "leaves", "terms per leaf", "size", "RMSE held-out", "spread of folds"});
  std::string notes;
  for (std::size_t p = 0; p < readable.partitions.size(); ++p) {
    const ReadablePartition& simple = readable.partitions[p];
    const PartitionSummary& full = fitted.summary.partitions[p];
    const Model whole = part_of(fitted.model, p);
    const std::string& target = fitted.model.outputs()[simple.outputs.front()].name;
    table.add({target, "as chosen above", count(full.leaves), count(most_terms(whole.partitions()[0])),
               count(expression_size(whole)), number(full.chosen.rmse),
               spread_text(full.chosen.spread, full.cv_folds)});
    table.add({"", "readable", count(simple.leaves), count(simple.most_terms), count(simple.size), number(simple.rmse),
               spread_text(simple.spread, full.cv_folds)});
    const CandidateError& linear = full.best_of_kind.front();
    const Model root = whole.prefix(1);
    table.add({"", "least squares", "1", count(most_terms(root.partitions()[0])), count(expression_size(root)),
               number(linear.rmse), spread_text(linear.spread, full.cv_folds)});
    notes += note_on(simple, readable.partitions.size() > 1 ? " of " + target : "", loss);
  }
  return fmt::format("\n{}Size: operators, constants and variables of the model as an expression.\n{}",
                     table.text(width), notes);
}

}  // namespace llmt::report
