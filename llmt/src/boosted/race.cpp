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
constexpr std::size_t most_paired = 4;       // inputs whose sums and differences are tried
constexpr std::size_t most_soft_paired = 6;  // and in soft trees, where these won
constexpr double allowed_at_first = 1.1;     // of the error: further directions pay only after some hundred rounds
constexpr double fewest_looked_at = 8.0;     // features with pairs: half of them within these bounds
constexpr double most_looked_at = 16.0;
constexpr const char* of_pairs = " with pairs";
constexpr double free_margin = 0.25;  // of 1 / sqrt(held-out rows): by how much a variant must be better
constexpr double soft_margin = 1.0;
constexpr double proof = 3.0;  // by so many standard errors of the mean difference of squares

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
std::vector<int> most_used(const BinnedRows& rows, const std::vector<GrowingTree>& trees, std::size_t most) {
  const std::vector<int> uses = uses_of(trees, rows.features.size());
  std::vector<int> features;
  for (int k = 0; k < std::ssize(uses); ++k) {
    if (rows.features[k].feature.level < 0) features.push_back(k);
  }
  std::ranges::stable_sort(features, std::greater{}, [&](int k) { return uses[k]; });
  if (features.size() > most) features.resize(most);
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

// From which rows each run of a variant learns, and on which it is judged.
std::vector<HoldOut> hold_outs_of(const BoostingData& data) {
  std::vector<HoldOut> hold_outs = {data.hold_outs.front()};
  if (data.regime.race == RaceRows::all_parts && !data.is_hold_out_given) {
    const int parts = std::ranges::max(data.parts) + 1;
    for (int part = 1; part < parts; ++part) hold_outs.push_back(part_apart(data.parts, part));
  }
  for (HoldOut& rows : hold_outs) rows.train = some_of(rows.train, raced_rows(std::ssize(rows.train)));
  return hold_outs;
}

// A variant after a few rounds.
struct Raced {
  Eigen::VectorXd residuals;       // of the rows of all hold-outs
  Eigen::VectorXd weights;         // of these
  double rmse = 0.0;               // of these
  std::vector<GrowingTree> trees;  // of the first hold-out
};

Raced run(const SumPlan& variant, const Eigen::VectorXd& output, const std::vector<HoldOut>& hold_outs,
          std::uint64_t seed, Work& work) {
  RoundOptions few = variant.rounds;
  few.rate = race_rate;
  few.most_rounds = race_rounds;
  std::vector<int> held_out;
  std::vector<double> residuals;
  Raced raced;
  for (const HoldOut& rows : hold_outs) {
    Random random(seed);  // the same for all
    Work part(work, work.left() / static_cast<double>(hold_outs.size()));
    Rounds rounds = boost(variant.rows, output, rows.train, rows.held_out, {}, few, random, part);
    held_out.insert(held_out.end(), rows.held_out.begin(), rows.held_out.end());
    residuals.insert(residuals.end(), rounds.residuals.begin(), rounds.residuals.end());
    if (raced.trees.empty()) raced.trees = std::move(rounds.trees);
  }
  raced.residuals = Eigen::Map<const Eigen::VectorXd>(residuals.data(), std::ssize(residuals));
  raced.weights = variant.rows.weights(held_out);
  raced.rmse = rmse_of(raced.residuals, raced.weights);
  return raced;
}

// Whether the squares are smaller in the mean, beyond what rows differ by chance: the mean of their differences, row by
// row, by its standard error.
bool is_proven(const Raced& smaller, const Raced& than) {
  const Eigen::ArrayXd gains =
      smaller.weights.array() * (than.residuals.array().square() - smaller.residuals.array().square());
  const double mean = gains.mean();
  return mean > proof * std::sqrt((gains - mean).square().mean() / static_cast<double>(gains.size()));
}

SumPlan with_constants(SumPlan plan) {
  plan.name += " with constants";
  plan.rounds.tree.slopes = 0;
  return plan;
}

SumPlan softened(SumPlan plan, const RoundOptions& usual) {
  plan.name = plan.name.ends_with(of_pairs) ? std::string("soft") + of_pairs : "soft";
  plan.rounds.tree.symmetric = true;
  plan.rounds.tree.slopes = usual.tree.slopes;
  plan.rounds.tree.softness = usual_softness;
  plan.rounds.rate = soft_rate;
  return plan;
}

}  // namespace

SumPlan race(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, std::uint64_t seed,
             Work& work) {
  const std::vector<HoldOut> hold_outs = hold_outs_of(data);
  const bool are_few = data.regime.race == RaceRows::all_parts;
  const std::size_t features = data.rows.features.size();
  std::vector<BoostVariant> compared;
  const auto run_variant = [&](const SumPlan& variant) {
    Work part(work, 0.2);
    Raced raced = run(variant, output, hold_outs, seed, part);
    compared.push_back({variant.name, raced.rmse});
    return raced;
  };
  const SumPlan first{usual, "symmetric", data.rows};
  const Raced symmetric = run_variant(first);
  SumPlan best = first;
  Raced least = symmetric;
  // The same without pairs where there are not two inputs.
  const auto with_pairs_of = [&](std::size_t most, SumPlan plan) {
    const std::vector<int> inputs = most_used(data.rows, symmetric.trees, most);
    if (inputs.size() < 2) return plan;
    if (!plan.name.ends_with(of_pairs)) plan.name += of_pairs;
    plan.rows = with_pairs(data, inputs);
    const auto all = static_cast<double>(plan.rows.features.size());
    const double half = std::clamp(0.5 * all, fewest_looked_at, most_looked_at);
    plan.rounds.tree.columns = std::min(1.0, std::max(half, static_cast<double>(features) / 4.0) / all);
    return plan;
  };
  const auto take_if = [&](SumPlan variant, const auto& is_better) {
    Raced raced = run_variant(variant);
    if (!is_better(raced, least)) return;
    least = std::move(raced);
    best = std::move(variant);
  };
  // `margin`: where the rows are many, the share of the error in units of 1 / sqrt(held-out rows).
  const auto is_better_by = [&](double margin) {
    return [=](const Raced& one, const Raced& than) {
      const double noise = 1.0 / std::sqrt(static_cast<double>(one.residuals.size()));
      return are_few ? is_proven(one, than) : one.rmse < than.rmse * (1.0 - margin * noise);
    };
  };
  if (!are_few) {
    SumPlan free = best;
    free.name = "free";
    free.rounds.tree.symmetric = false;
    take_if(std::move(free), is_better_by(free_margin));
  }
  take_if(with_constants(best), is_proven);
  if (SumPlan paired = with_pairs_of(most_paired, best); paired.rows.features.size() > features) {
    take_if(std::move(paired), is_better_by(0.0));
  }
  take_if(softened(best, usual), is_better_by(soft_margin));
  if (best.rounds.tree.softness > 0.0) {
    SumPlan paired = with_pairs_of(most_soft_paired, best);
    if (paired.rows.features.size() > best.rows.features.size()) {
      take_if(std::move(paired), [=](const Raced& one, const Raced& than) {
        return are_few ? is_proven(one, than) : one.rmse < allowed_at_first * than.rmse;
      });
    }
  }
  if (are_few && best.name != first.name) {  // a short race judges the start, and long ones of few rows are cheap
    const HoldOut& apart = data.hold_outs.front();
    const auto error_at_the_end = [&](const SumPlan& plan) {
      Random random(seed);
      Work part(work, 0.5 * work.left());
      return boost(plan.rows, output, apart.train, apart.held_out, {}, plan.rounds, random, part).rmse;
    };
    if (error_at_the_end(first) < error_at_the_end(best)) best = first;
  }
  best.compared = std::move(compared);
  return best;
}

}  // namespace llmt
