#include "llmt/readable_summary.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "llmt/size.hpp"

namespace llmt::apps {
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

void print_readable(const FitResult& fitted, const ReadableResult& readable, double loss) {
  Table table({"target", "model", "leaves", "terms a leaf", "size", "RMSE held-out", "+-"});
  std::string best;
  for (std::size_t p = 0; p < readable.partitions.size(); ++p) {
    const ReadablePartition& simple = readable.partitions[p];
    const PartitionSummary& full = fitted.summary.partitions[p];
    const Model whole = part_of(fitted.model, p);
    const std::string& target = fitted.model.outputs()[simple.outputs.front()].name;
    table.add({target, "as chosen above", count(full.leaves), count(most_terms(whole.partitions()[0])),
               count(expression_size(whole)), number(full.chosen.rmse), number(full.chosen.spread, 2)});
    table.add({"", "readable", count(simple.leaves), count(simple.most_terms), count(simple.size), number(simple.rmse),
               number(simple.spread, 2)});
    const CandidateError& linear = full.best_of_kind.front();
    const Model root = whole.prefix(1);
    table.add({"", "least squares", "1", count(most_terms(root.partitions()[0])), count(expression_size(root)),
               number(linear.rmse), number(linear.spread, 2)});
    best += fmt::format("{}{}: {}{}", best.empty() ? "" : "; ", target, number(simple.best_crisp),
                        simple.is_within_loss ? "" : ", and no readable tree came near enough");
  }
  print(fmt::format(
      "\n{}Size: operators, constants and variables of the model as an expression. The readable tree is the "
      "smallest one whose held-out RMSE is at most {:g} % above the best of all crisp trees that were tried, those "
      "with "
      "short equations included ({}).\n",
      table.text(), 100.0 * loss, best));
}

}  // namespace llmt::apps
