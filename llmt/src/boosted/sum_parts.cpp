#include "boosted/sum_parts.hpp"

#include <utility>

namespace llmt {
namespace {

void multiply(BoostedTree& tree, double by) {
  for (BoostedLeaf& leaf : tree.leaves) {
    leaf.constant *= by;
    leaf.low *= by;
    leaf.high *= by;
    for (double& slope : leaf.slopes) slope *= by;
  }
}

}  // namespace

BoostedSum sum_of(const std::vector<SumPart>& members, const BinnedRows& rows, double mean, double scale) {
  BoostedSum sum{.base = mean, .rate = members.front().rate, .features = {}, .trees = {}};
  for (const BinnedFeature& feature : rows.features) sum.features.push_back(feature.feature);
  for (const SumPart& part : members) {
    sum.base += scale * part.share * part.rounds.base;
    const auto add = [&](BoostedTree tree, double rate) {
      multiply(tree, scale * (part.share * rate / sum.rate));
      sum.trees.push_back(std::move(tree));
    };
    for (const BoostedTree& tree : part.start) add(tree, 1.0);
    for (const GrowingTree& tree : part.rounds.trees) add(finished(tree, rows), part.rate);
  }
  return sum;
}

}  // namespace llmt
