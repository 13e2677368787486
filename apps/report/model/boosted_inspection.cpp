#include "report/model/boosted_inspection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace llmt::report {
namespace {

// Numbers of the parts of a sum. A use of a sum of several inputs counts for each.
struct Uses {
  Eigen::Index trees = 0;
  Eigen::Index leaves = 0;
  Eigen::Index all_splits = 0;
  Eigen::Index soft_splits = 0;
  Eigen::Index of_several = 0;            // splits
  std::vector<Eigen::Index> splits = {};  // of each input
  std::vector<Eigen::Index> slopes = {};
};

Uses uses_of(const BoostedModel& model, const BoostedSum& sum) {
  Uses uses;
  uses.splits.assign(model.num_inputs(), 0);
  uses.slopes.assign(model.num_inputs(), 0);
  const auto add = [&](std::vector<Eigen::Index>& counts, int feature) {
    for (const int input : sum.features[feature].inputs) ++counts[input];
  };
  for (const BoostedTree& tree : sum.trees) {
    ++uses.trees;
    uses.leaves += std::ssize(tree.leaves);
    uses.all_splits += std::ssize(tree.splits);
    for (const BoostedSplit& split : tree.splits) {
      add(uses.splits, split.feature);
      uses.soft_splits += split.half_width > 0.0 ? 1 : 0;
      uses.of_several += sum.features[split.feature].inputs.size() > 1 ? 1 : 0;
    }
    for (const BoostedLeaf& leaf : tree.leaves) {
      for (const int feature : leaf.features) add(uses.slopes, feature);
    }
  }
  return uses;
}

std::string share(Eigen::Index part, Eigen::Index all) {
  return fmt::format("{:.0f} %", all == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(all));
}

}  // namespace

std::string boosted_inspection_text(const BoostedModel& model, const std::string& name, std::size_t width) {
  const BoostedSize size = size_of(model);
  std::string text = fmt::format("{}: a sum of trees for each target; {} trees, {} leaves, {} parameters\n\n", name,
                                 size.trees, size.leaves, size.parameters);
  Table inputs({"input", "low", "high", "mean"});
  for (const InputColumn& input : model.inputs()) {
    if (input.is_categorical()) {
      std::vector<std::string> levels;
      for (std::size_t k = 0; k < input.levels.size(); ++k) levels.push_back(input.shown_level(k));
      inputs.add({input.name, fmt::format("{} levels: {}", levels.size(), first_names(levels)), "", ""});
    } else {
      inputs.add({input.name, number(input.low), number(input.high), number(input.centre)});
    }
  }
  text += inputs.text(width);
  if (const Eigen::Index most = model.record().size_limit; most > 0) {
    text += fmt::format("\nFitted with at most {} rounds, as --max-rounds {} does\n", most, most);
  }
  for (std::size_t o = 0; o < model.sums().size(); ++o) {
    const BoostedSum& sum = model.sums()[o];
    const Uses uses = uses_of(model, sum);
    text += fmt::format("\n{} = {} + {} times the sum of {} trees with {} leaves\n", model.outputs()[o].name,
                        number(sum.base, 6), number(sum.rate), uses.trees, uses.leaves);
    std::vector<std::size_t> order(uses.splits.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::greater{}, [&](std::size_t j) { return uses.splits[j]; });
    Table table({"input", "splits", "share of splits", "slopes"});
    for (const std::size_t j : order) {
      table.add({model.inputs()[j].name, fmt::format("{}", uses.splits[j]), share(uses.splits[j], uses.all_splits),
                 fmt::format("{}", uses.slopes[j])});
    }
    text += table.text(width);
    if (uses.soft_splits > 0)
      text += fmt::format("{} of the splits are soft\n", share(uses.soft_splits, uses.all_splits));
    if (uses.of_several > 0) {
      text += wrapped(fmt::format("{} of the splits compare a sum of inputs, and count for each of them\n",
                                  share(uses.of_several, uses.all_splits)),
                      width);
    }
  }
  return text + wrapped(
                    "\nNobody reads a sum. llmt explain says which inputs predictions come from; a tree that can be "
                    "read is fitted without --boost.\n",
                    width);
}

Json boosted_inspection_json(const BoostedModel& model) {
  const BoostedSize size = size_of(model);
  Json json = {{"trees", size.trees}, {"leaves", size.leaves}, {"parameters", size.parameters}};
  if (const Eigen::Index most = model.record().size_limit; most > 0) json["max_rounds"] = most;
  json["inputs"] = Json::array();
  for (const InputColumn& input : model.inputs()) {
    json["inputs"].push_back(
        {{"name", input.name}, {"low", input.low}, {"high", input.high}, {"centre", input.centre}});
    if (input.is_categorical()) json["inputs"].back()["levels"] = input.levels;
  }
  json["sums"] = Json::array();
  for (std::size_t o = 0; o < model.sums().size(); ++o) {
    const Uses uses = uses_of(model, model.sums()[o]);
    json["sums"].push_back({{"target", model.outputs()[o].name},
                            {"base", model.sums()[o].base},
                            {"rate", model.sums()[o].rate},
                            {"trees", uses.trees},
                            {"leaves", uses.leaves},
                            {"splits", uses.all_splits},
                            {"soft_splits", uses.soft_splits},
                            {"splits_of_pairs", uses.of_several},
                            {"splits_of_inputs", uses.splits},
                            {"slopes_of_inputs", uses.slopes}});
  }
  return json;
}

}  // namespace llmt::report
