#include "boosted/race.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace llmt {
namespace {

// docs/benchmarks.md, "Sums of trees", says on which tables these were chosen.
constexpr int race_rounds = 50;
constexpr double race_rate = 0.3;
constexpr std::size_t most_paired = 4;  // inputs whose sums and differences are tried
constexpr double free_margin = 0.25;    // of 1 / sqrt(held-out rows): by how much a variant must be better
constexpr double soft_margin = 1.0;

// So many of the rows, evenly spread over them.
std::vector<int> some_of(const std::vector<int>& rows, Eigen::Index most) {
  const Eigen::Index all = std::ssize(rows);
  if (all <= most) return rows;
  std::vector<int> some;
  for (Eigen::Index k = 0; k < most; ++k) some.push_back(rows[k * all / most]);
  return some;
}

// How often each feature is used, counted once a level of a symmetric tree.
std::vector<int> uses_of(const std::vector<GrowingTree>& trees, std::size_t features) {
  std::vector<int> uses(features, 0);
  for (const GrowingTree& tree : trees) {
    std::vector<std::pair<int, int>> seen;
    for (const GrowingNode& node : tree) {
      const std::pair<int, int> split = {node.feature, node.cell};
      if (node.feature < 0 || std::ranges::count(seen, split) > 0) continue;
      seen.push_back(split);
      ++uses[node.feature];
    }
  }
  return uses;
}

// The numeric inputs that symmetric trees use most.
std::vector<int> most_used(const BinnedRows& rows, const std::vector<GrowingTree>& trees) {
  const std::vector<int> uses = uses_of(trees, rows.features.size());
  std::vector<int> features;
  for (int k = 0; k < std::ssize(uses); ++k) {
    if (rows.features[k].feature.level < 0) features.push_back(k);
  }
  std::ranges::stable_sort(features, std::greater{}, [&](int k) { return uses[k]; });
  if (features.size() > most_paired) features.resize(most_paired);
  std::vector<int> inputs;
  for (const int k : features) inputs.push_back(rows.features[k].feature.first);
  std::ranges::sort(inputs);
  return inputs;
}

// The rows with the sums and differences of inputs.
BinnedRows with_pairs(const BoostingData& data, const std::vector<int>& inputs) {
  BinnedRows rows = data.rows;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t j = i + 1; j < inputs.size(); ++j) {
      for (const double sign : {1.0, -1.0}) {
        rows.features.push_back(feature_of(data, {.first = inputs[i], .second = inputs[j], .sign = sign}));
      }
    }
  }
  return rows;
}

}  // namespace

SumPlan race(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, std::uint64_t seed,
             Work& work) {
  const HoldOut& apart = data.hold_outs.front();
  const std::vector<int> train = some_of(apart.train, raced_rows(std::ssize(apart.train)));
  const double noise = 1.0 / std::sqrt(static_cast<double>(apart.held_out.size()));
  std::vector<BoostVariant> compared;
  const auto run = [&](const SumPlan& variant) {
    RoundOptions few = variant.rounds;
    few.rate = race_rate;
    few.most_rounds = race_rounds;
    Random random(seed);  // the same for all
    Work part(work, 0.25);
    Rounds rounds = boost(variant.rows, output, train, apart.held_out, {}, few, random, part);
    compared.push_back({variant.name, rounds.rmse});
    return rounds;
  };
  SumPlan best{usual, "symmetric", data.rows};
  const Rounds symmetric = run(best);
  double least = symmetric.rmse;
  const auto take_if_better = [&](SumPlan variant, double margin) {
    const double error = run(variant).rmse;
    if (error >= least * (1.0 - margin * noise)) return;
    least = error;
    best = std::move(variant);
  };
  SumPlan free = best;
  free.name = "free";
  free.rounds.tree.symmetric = false;
  take_if_better(std::move(free), free_margin);
  if (const std::vector<int> inputs = most_used(data.rows, symmetric.trees); inputs.size() >= 2) {
    SumPlan paired{best.rounds, best.name + " with pairs", with_pairs(data, inputs)};
    const double looked_at = std::max(8.0, static_cast<double>(data.rows.features.size()) / 4.0);
    paired.rounds.tree.columns = std::min(1.0, looked_at / static_cast<double>(paired.rows.features.size()));
    take_if_better(std::move(paired), 0.0);
  }
  SumPlan soft = best;
  soft.name = soft.rows.features.size() > data.rows.features.size() ? "soft with pairs" : "soft";
  soft.rounds.tree.symmetric = true;
  soft.rounds.tree.softness = usual_softness;
  soft.rounds.rate = soft_rate;
  take_if_better(std::move(soft), soft_margin);
  best.compared = std::move(compared);
  return best;
}

}  // namespace llmt
