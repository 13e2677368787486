#include <algorithm>
#include <cmath>
#include <limits>

#include "boosted/all_fifths.hpp"
#include "boosted/average.hpp"
#include "boosted/race.hpp"
#include "llmt/boosted.hpp"
#include "llmt/statistics.hpp"
#include "spread/fit_gaps.hpp"
#include "spread/fit_spread.hpp"

namespace llmt {
namespace {

// Sorted; of more than `most`, evenly spaced ones, which say as much of intervals.
std::vector<double> ascending(std::vector<double> residuals, std::size_t most) {
  std::ranges::sort(residuals);
  const std::size_t count = residuals.size();
  if (count <= most) return residuals;
  std::vector<double> kept;
  for (std::size_t k = 0; k < most; ++k) kept.push_back(residuals[(2 * k + 1) * count / (2 * most)]);
  return kept;
}

// The held-out rows by the parts whose spreads are learnt from one another: folds, or random parts of the only one.
struct DealtRows {
  std::vector<int> rows;
  std::vector<int> part;
  int parts = 1;
};

DealtRows dealt_rows(const BoostingData& data, Eigen::Index held_out) {
  if (held_out == data.y.rows()) return {all_rows(held_out), data.parts, std::ranges::max(data.parts) + 1};
  const std::vector<int>& rows = data.hold_outs.front().held_out;
  return {rows, dealt_parts(std::ssize(rows), parts_of_one_fold), parts_of_one_fold};
}

// `residuals`: of the held-out rows.
std::vector<SumResiduals> held_out_residuals(const BoostingData& data, Eigen::Index output,
                                             const Eigen::VectorXd& residuals) {
  constexpr std::size_t most = 10000;
  const DealtRows of = dealt_rows(data, residuals.size());
  const Eigen::MatrixXd x = with_empty_levels(data.inputs, data.x(of.rows, Eigen::all));
  const Eigen::VectorXd predictions = data.y.col(output)(of.rows) - residuals;
  const Eigen::VectorXd errors = residuals.cwiseAbs();
  const Eigen::VectorXd weights = data.precisions.size() > 0 ? data.precisions(of.rows).eval() : Eigen::VectorXd();
  const std::vector<Spread> spreads = fit_spreads({x, data.inputs, predictions, errors, weights}, of.part, of.parts);
  if (std::ranges::all_of(spreads, &Spread::is_even)) {
    return {{ascending({errors.begin(), errors.end()}, most)}};
  }
  std::vector<SumResiduals> parts;
  for (int p = 0; p < of.parts; ++p) {
    std::vector<double> scaled;
    for (Eigen::Index i = 0; i < errors.size(); ++i) {
      if (of.part[i] != p) continue;
      const double spread = spread_at(spreads[p], x, i, predictions(i));
      scaled.push_back(errors(i) / (weights.size() > 0 ? spread * factor_of_weight(spreads[p], weights(i)) : spread));
    }
    parts.push_back({ascending(std::move(scaled), most / static_cast<std::size_t>(of.parts)), spreads[p]});
  }
  return parts;
}

// An output divided by its deviation about its mean.
struct Standardised {
  Eigen::VectorXd values;
  double mean = 0.0;
  double scale = 1.0;
};

Standardised standardised(const Eigen::VectorXd& output, const Eigen::VectorXd& weights) {
  const double mean = output.dot(weights) / weights.sum();
  const Eigen::VectorXd deviations = output.array() - mean;
  const double deviation = rmse_of(deviations, weights);
  const double scale = deviation > 0.0 ? deviation : 1.0;
  return {deviations / scale, mean, scale};
}

RoundOptions usual_rounds(const BoostingData& data, const BoostOptions& options) {
  const Regime& regime = data.regime;
  return {.tree = {.depth = depth_of(data.y.rows()),
                   .slopes = regime.slopes,
                   .ridges = {.constant = regime.ridge, .slope = 1.0},
                   .searched = regime.searched},
          .rate = regime.rate,
          .most_rounds = options.max_rounds,
          .patience = regime.patience,
          .max_threads = options.max_threads};
}

// What the sum leaves in each row.
Eigen::VectorXd left_by(const Rounds& rounds, double rate, const BinnedRows& rows, const Eigen::VectorXd& output) {
  Eigen::VectorXd left = output.array() - rounds.base;
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    for (const GrowingTree& tree : rounds.trees) left(i) -= rate * value_at(tree, rows, i);
  }
  return left;
}

// The standard deviation of the errors of the parts of the rows; `residuals`: of all rows, in their order.
double spread_of_parts(const BoostingData& data, const Eigen::VectorXd& residuals) {
  Eigen::VectorXd of_parts(std::ranges::max(data.parts) + 1);
  for (int part = 0; part < of_parts.size(); ++part) {
    const std::vector<int> rows = part_apart(data.parts, part).held_out;
    of_parts(part) = rmse_of(residuals(rows), data.rows.weights(rows));
  }
  return spread_of(of_parts);
}

// The error of all rows in the place of that of the part 0, whose rows chose.
void use_all_parts(const BoostingData& data, Eigen::VectorXd residuals, Average& result, BoostSummary& summary) {
  residuals(data.hold_outs.front().held_out) = result.residuals;
  summary.held_out = residuals.size();
  result.rmse = rmse_of(residuals, data.rows.weights);
  result.residuals = std::move(residuals);
}

// The sum that one set of held-out rows stops, and one tree beside it.
Average stopped(const BoostingData& data, const Eigen::VectorXd& output, const SumPlan& plan,
                const BoostOptions& options, Random& random, BoostSummary& summary, Work& work) {
  const HoldOut& apart = data.hold_outs.front();
  const Regime& regime = data.regime;
  const bool uses_all_parts = regime.uses_all_parts && !data.is_hold_out_given;
  const bool is_refitted = !data.is_hold_out_given && is_worth_refitting(std::ssize(apart.held_out), output.size());
  Work stopping(work, (uses_all_parts ? 0.2 : is_refitted ? 0.4 : 1.0) * work.left());
  Rounds rounds = boost(plan.rows, output, apart.train, apart.held_out, {}, plan.rounds, random, stopping);
  const Eigen::Index trees = std::ssize(rounds.trees);
  summary.held_out = std::ssize(apart.held_out);
  summary.rows = is_refitted ? output.size() : std::ssize(apart.train);
  Average result{.variants = plan.compared, .residuals = rounds.residuals, .rmse = rounds.rmse};
  const bool is_tree_tried =
      !data.is_hold_out_given && (regime.uses_all_parts || (!regime.rules_of_tree.empty() &&
                                                            std::ssize(rounds.trees) <= regime.most_rounds_of_tree));
  if (is_refitted) {
    RoundOptions more = plan.rounds;
    more.most_rounds = static_cast<int>(std::ceil(more_trees * static_cast<double>(rounds.trees.size())));
    std::vector<GrowingTree> kept;
    if (!regime.uses_all_parts && more.tree.symmetric) kept = std::move(rounds.trees);
    Work refitting(work, (uses_all_parts ? 0.3 : is_tree_tried ? 0.7 : 1.0) * work.left());
    rounds = boost(plan.rows, output, all_rows(output.size()), {}, kept, more, random, refitting);
  } else if (is_tree_tried) {
    rounds.residuals = left_by(rounds, plan.rounds.rate, plan.rows, output);  // a tree beside it is of all rows
  }
  result.train_rmse = rounds.train_rmse;
  result.parts.push_back({.rate = plan.rounds.rate, .rounds = std::move(rounds)});
  if (!is_tree_tried) {
    for (BoostVariant& variant : result.variants) variant.share = variant.name == plan.name ? 1.0 : 0.0;
    return result;
  }
  // The errors of a race are those of a few rounds, not of the sum.
  result.rmse = rmse_of(result.residuals, data.rows.weights(apart.held_out));
  result.variants.push_back({plan.name, result.rmse, 1.0});
  Work part(work, (uses_all_parts ? 0.3 : 1.0) * work.left());
  result = with_one_tree(data, output, std::move(result), plan.rounds.max_threads, part);
  if (!uses_all_parts) return result;
  const double of_sum = result.variants[plan.compared.size()].share;  // behind those of the race
  const Eigen::Vector2d shares(of_sum, result.tree ? result.variants.back().share : 0.0);
  std::optional<Eigen::VectorXd> others =
      residuals_of_other_parts(data, output, {plan, trees, shares, result.tree}, options.seed, work);
  if (others) use_all_parts(data, *std::move(others), result, summary);
  return result;
}

// Whether every row has a residual of trees fitted without it. Then each seed may hold out other rows.
bool has_all_residuals(const BoostingData& data) {
  return data.regime.takes_turns || (data.regime.uses_all_parts && !data.is_hold_out_given);
}

// The mean of sums of several seeds. `first`: the rows of the first one, and of all where they hold out the same ones.
Average mean_of(const BoostingData& first, std::vector<Average> sums) {
  if (sums.size() == 1) return std::move(sums.front());
  const auto count = static_cast<double>(sums.size());
  const Eigen::VectorXd& weights = first.rows.weights;
  const Eigen::Index rows = has_all_residuals(first) ? weights.size() : sums.front().residuals.size();
  // Where one seed could not be held against all rows, the first one's residuals are those that there are.
  const bool is_complete = std::ranges::all_of(sums, [&](const Average& sum) { return sum.residuals.size() == rows; });
  Average mean = std::move(sums.front());
  for (std::size_t k = 1; k < sums.size(); ++k) {
    if (is_complete) mean.residuals += sums[k].residuals;
    mean.train_rmse += sums[k].train_rmse;
    std::ranges::move(sums[k].parts, std::back_inserter(mean.parts));
  }
  mean.train_rmse /= count;
  for (SumPart& part : mean.parts) part.share /= count;
  if (!is_complete) return mean;
  mean.residuals /= count;
  const bool is_of_all = mean.residuals.size() == weights.size();
  mean.rmse = rmse_of(mean.residuals, is_of_all ? weights : Eigen::VectorXd(weights(first.hold_outs.front().held_out)));
  return mean;
}

// `deals`: the rows of the first seed, and of the others where they hold out other rows.
BoostedSum fit_output(const std::vector<BoostingData>& deals, Eigen::Index output, const BoostOptions& options,
                      BoostSummary& summary, Work& work) {
  const BoostingData& data = deals.front();
  const auto [y, mean, scale] = standardised(data.y.col(output), data.rows.weights);
  if (data.hold_outs.empty()) {
    summary.rows = y.size();
    summary.rmse = std::numeric_limits<double>::quiet_NaN();
    summary.variant = "mean";
    summary.train_rmse = scale * rmse_of(y, data.rows.weights);
    return {.base = mean, .features = {}, .trees = {}};
  }
  SumPlan plan{usual_rounds(data, options), "symmetric", data.rows};
  if (data.regime.race != RaceRows::none) {
    Work racing(work, 0.2);
    plan = race(data, y, plan.rounds, options.seed, racing);
  }
  if (options.rate > 0.0) plan.rounds.rate = options.rate;
  std::vector<Average> sums;
  for (int k = 0; k < options.seeds; ++k) {
    Work part(work, work.left() / (options.seeds - k));
    BoostOptions own = options;
    own.seed += static_cast<std::uint64_t>(k);
    Random random(own.seed);
    const BoostingData& dealt = deals[std::min<std::size_t>(k, deals.size() - 1)];
    if (data.regime.takes_turns) {
      summary.rows = summary.held_out = y.size();
      sums.push_back(average(dealt, y, plan.rounds, options.rate > 0.0, random, part));
    } else {
      sums.push_back(stopped(dealt, y, plan, own, random, summary, part));
    }
  }
  Average result = mean_of(data, std::move(sums));
  summary.held_out = result.residuals.size();
  summary.seeds = options.seeds;
  summary.rmse = scale * result.rmse;
  if (result.residuals.size() == y.size()) summary.spread = scale * spread_of_parts(data, result.residuals);
  summary.train_rmse = scale * result.train_rmse;
  summary.variant = result.parts.size() > 1 ? "blend" : plan.name;
  summary.compared = std::move(result.variants);
  for (BoostVariant& variant : summary.compared) {
    variant.rmse *= scale;
    if (variant.share == 1.0) summary.variant = variant.name;
  }
  BoostedSum sum = sum_of(result.parts, plan.rows, mean, scale);
  summary.trees = std::ssize(sum.trees);
  sum.held_out = held_out_residuals(data, output, scale * result.residuals);
  return sum;
}

// A spread of inputs that stand elsewhere: input j in the column columns[j].
Spread with_columns(const Spread& spread, const std::vector<int>& columns) {
  Spread moved = spread;
  for (SpreadNode& node : moved.nodes) {
    if (node.column < std::ssize(columns)) node.column = columns[node.column];
  }
  for (std::size_t j = 0; j < spread.levels.size(); ++j) moved.levels[columns[j]] = spread.levels[j];
  return moved;
}

// The gaps of all rows in all numbers, where the caller has them.
std::vector<Gap> gaps_of(const BoostingData& data) {
  std::vector<int> columns;
  for (int j = 0; j < std::ssize(data.inputs); ++j) {
    if (!data.inputs[j].is_categorical()) columns.push_back(j);
  }
  std::vector<Gap> gaps = fit_gaps(data.x, columns);
  for (Gap& gap : gaps) {
    for (GapSide& side : gap.sides) side.column = data.columns[side.column];
  }
  return gaps;
}

// The record of the inputs that the sums use, where the caller has them.
TrainingRecord record_of_rows(const BoostingData& data, const std::vector<bool>& used, int max_rounds) {
  TrainingRecord record;
  if (max_rounds != BoostOptions().max_rounds) record.size_limit = max_rounds;
  record.inputs.resize(data.inputs.size());
  const Eigen::MatrixXd x = with_empty_levels(data.inputs, data.x);
  for (std::size_t j = 0; j < data.inputs.size(); ++j) {
    if (!used[data.columns[j]]) continue;
    record.inputs[data.columns[j]] = record_of(x.col(static_cast<Eigen::Index>(j)), data.inputs[j].levels.size());
  }
  return record;
}

// The model with its inputs where the caller has them.
BoostedModel model_of(const BoostingData& data, std::vector<BoostedSum> sums, int max_rounds) {
  std::vector<InputColumn> inputs(data.inputs.size());
  std::vector<double> deviations(data.inputs.size());
  for (std::size_t j = 0; j < data.inputs.size(); ++j) {
    inputs[data.columns[j]] = data.inputs[j];
    deviations[data.columns[j]] = data.deviations[j];
  }
  for (BoostedSum& sum : sums) {
    for (BoostedFeature& feature : sum.features) {
      for (int& input : feature.inputs) input = data.columns[input];
    }
    for (SumResiduals& part : sum.held_out) part.spread = with_columns(part.spread, data.columns);
  }
  const BoostedModel model(inputs, data.outputs, deviations, sums);
  return {std::move(inputs), data.outputs,  std::move(deviations),
          std::move(sums),   gaps_of(data), record_of_rows(data, used_inputs(model), max_rounds)};
}

}  // namespace

BoostResult fit_boosted(const TrainingData& data, const BoostOptions& options, const Progress& progress) {
  Work work(progress);
  std::vector<BoostingData> deals;
  deals.push_back(boosting_data(data, options));
  for (int k = 1; k < options.seeds && has_all_residuals(deals.front()); ++k) {
    BoostOptions own = options;
    own.seed += static_cast<std::uint64_t>(k);
    deals.push_back(boosting_data(data, own));
  }
  const BoostingData& rows = deals.front();
  std::vector<BoostedSum> sums;
  std::vector<BoostSummary> summaries;
  for (Eigen::Index output = 0; output < rows.y.cols(); ++output) {
    Work part(work, work.left() / static_cast<double>(rows.y.cols() - output));
    sums.push_back(fit_output(deals, output, options, summaries.emplace_back(), part));
  }
  BoostResult result{model_of(rows, std::move(sums), options.max_rounds), std::move(summaries)};
  work.finish();
  return result;
}

}  // namespace llmt
