#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "boosted/blend.hpp"
#include "boosted/boosting.hpp"
#include "boosted/boosting_data.hpp"
#include "boosted/sum_parts.hpp"
#include "llmt/boosted.hpp"

namespace llmt {
namespace {

// docs/algorithms/boosting.md says on which tables these were chosen.
constexpr Eigen::Index enough_for_races = 5000;
constexpr Eigen::Index enough_for_fast = 10000;
constexpr int race_rounds = 50;
constexpr Eigen::Index most_raced = 10000;  // rows that trees of the race learn from, or
constexpr Eigen::Index raced_part = 4;      // a quarter of the rows, if that is more,
constexpr Eigen::Index most_of_many_raced = 100000;
constexpr Eigen::Index refitted_part = 20;  // the sum is fitted to all rows if more than this part was held out
constexpr int patience_of_few = 200;        // below enough_for_races, whose few held-out rows err,
constexpr int patience_of_folds = 100;      // and where every row is held out once
constexpr double race_rate = 0.3;
// From enough_for_races on one tree is tried where the sum stops early: there is little to find, or one smooth tree is
// the truth. With more trees the sum is better, and the tree costs time for nothing.
constexpr std::size_t most_trees_for_one = 200;
constexpr Eigen::Index most_rows_for_one = 50000;
constexpr Eigen::Index most_inputs_for_one = 32;
constexpr int most_paired = 4;        // inputs whose sums and differences are tried
constexpr double free_margin = 0.25;  // of 1 / sqrt(held-out rows): by how much a variant must be better
constexpr double soft_margin = 1.0;

TreeOptions usual_trees(Eigen::Index rows) {
  TreeOptions tree;
  const bool few = rows < enough_for_races;
  tree.slopes = few ? 3 : 5;
  tree.ridges = {.constant = few ? 3.0 : 1.0, .slope = 1.0};
  constexpr double train_share = 0.8;
  constexpr double rows_of_leaf = 16.0;
  tree.depth = static_cast<int>(
      std::clamp(std::floor(std::log2(train_share * static_cast<double>(rows) / rows_of_leaf)), 1.0, 6.0));
  return tree;
}

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

// The numeric inputs that are used most.
std::vector<int> most_used(const BoostingData& data, const std::vector<int>& uses) {
  std::vector<int> features;
  for (int k = 0; k < std::ssize(uses); ++k) {
    if (data.rows.features[k].feature.level < 0) features.push_back(k);
  }
  std::ranges::stable_sort(features, std::greater{}, [&](int k) { return uses[k]; });
  if (std::ssize(features) > most_paired) features.resize(most_paired);
  std::vector<int> inputs;
  for (const int k : features) inputs.push_back(data.rows.features[k].feature.first);
  std::ranges::sort(inputs);
  return inputs;
}

// Sorted; of many, evenly spaced ones, which say as much of intervals.
std::vector<double> ascending(std::vector<double> residuals) {
  constexpr std::size_t most = 10000;
  std::ranges::sort(residuals);
  const std::size_t count = residuals.size();
  if (count <= most) return residuals;
  std::vector<double> kept;
  for (std::size_t k = 0; k < most; ++k) kept.push_back(residuals[(2 * k + 1) * count / (2 * most)]);
  return kept;
}

// The fit of one output.
class OutputFit {
 public:
  OutputFit(BoostingData& data, Eigen::Index output, const BoostOptions& options)
      : data_(data), options_(options), random_(options.seed) {
    y_ = data.y.col(output);
    mean_ = y_.dot(data.rows.weights) / data.rows.weights.sum();
    const Eigen::VectorXd deviations = y_.array() - mean_;
    scale_ = std::sqrt(deviations.cwiseAbs2().dot(data.rows.weights) / data.rows.weights.sum());
    if (!(scale_ > 0.0)) scale_ = 1.0;
    y_ = deviations / scale_;
  }

  BoostedSum fit(BoostSummary& summary, Work& work) {
    if (data_.hold_outs.empty()) return mean_alone(summary);
    const Eigen::Index rows = y_.size();
    rounds_.tree = usual_trees(rows);
    rounds_.rate = rows < enough_for_fast ? 0.05 : rows <= many_rows ? 0.07 : 0.1;
    if (rows < enough_for_races) rounds_.patience = data_.hold_outs.size() > 1 ? patience_of_folds : patience_of_few;
    rounds_.max_threads = options_.max_threads;
    name_ = "symmetric";
    if (rows >= enough_for_races && data_.hold_outs.size() == 1) {
      Work racing(work, 0.2);
      race_all(summary, racing);
    }
    if (options_.rate > 0.0) rounds_.rate = options_.rate;
    rounds_.most_rounds = options_.max_rounds;
    const std::vector<SumPart> members = data_.hold_outs.size() > 1 ? finish_few(summary, work) : finish(summary, work);
    BoostedSum sum = sum_of(members, data_.rows, mean_, scale_);
    summary.trees = std::ssize(sum.trees);
    const Eigen::VectorXd absolute = scale_ * residuals_.cwiseAbs();
    sum.residuals = ascending({absolute.begin(), absolute.end()});
    return sum;
  }

 private:
  BoostedSum mean_alone(BoostSummary& summary) const {
    summary.rows = y_.size();
    summary.rmse = std::numeric_limits<double>::quiet_NaN();
    summary.variant = "mean";
    summary.train_rmse = scale_ * std::sqrt(y_.cwiseAbs2().dot(data_.rows.weights) / data_.rows.weights.sum());
    return {.base = mean_, .features = {}, .trees = {}};
  }

  Rounds race(const RoundOptions& variant, const std::string& name, BoostSummary& summary, Work& work) {
    RoundOptions few = variant;
    few.rate = race_rate;
    few.most_rounds = race_rounds;
    Random random(options_.seed);  // the same for all
    Work part(work, 0.25);
    const HoldOut& rows = data_.hold_outs.front();
    const Eigen::Index most = std::clamp(std::ssize(rows.train) / raced_part, most_raced, most_of_many_raced);
    Rounds result = boost(data_.rows, y_, some_of(rows.train, most), rows.held_out, {}, few, random, part);
    summary.compared.push_back({name, result.rmse * scale_});
    return result;
  }

  void race_all(BoostSummary& summary, Work& work) {
    const double noise = 1.0 / std::sqrt(static_cast<double>(data_.hold_outs.front().held_out.size()));
    const Rounds symmetric = race(rounds_, name_, summary, work);
    double best = symmetric.rmse;
    RoundOptions variant = rounds_;
    variant.tree.symmetric = false;
    if (const double error = race(variant, "free", summary, work).rmse; error < best * (1.0 - free_margin * noise)) {
      best = error;
      rounds_ = variant;
      name_ = "free";
    }
    best = race_pairs(symmetric, best, summary, work);
    variant = rounds_;
    variant.tree.symmetric = true;
    variant.tree.softness = usual_softness;
    const bool paired = data_.rows.features.size() > usual_;
    const std::string name = paired ? "soft with pairs" : "soft";
    if (race(variant, name, summary, work).rmse < best * (1.0 - soft_margin * noise)) {
      rounds_ = variant;
      rounds_.rate = soft_rate;
      name_ = name;
    }
  }

  // Sums and differences of the inputs used most.
  double race_pairs(const Rounds& symmetric, double best, BoostSummary& summary, Work& work) {
    usual_ = data_.rows.features.size();
    const std::vector<int> inputs = most_used(data_, uses_of(symmetric.trees, usual_));
    if (inputs.size() < 2) return best;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      for (std::size_t j = i + 1; j < inputs.size(); ++j) {
        add_feature(data_, {.first = inputs[i], .second = inputs[j], .sign = 1.0});
        add_feature(data_, {.first = inputs[i], .second = inputs[j], .sign = -1.0});
      }
    }
    RoundOptions variant = rounds_;
    const double looked_at = std::max(8.0, static_cast<double>(usual_) / 4.0);
    variant.tree.columns = std::min(1.0, looked_at / static_cast<double>(data_.rows.features.size()));
    const std::string name = name_ + " with pairs";
    const double error = race(variant, name, summary, work).rmse;
    if (error >= best) {
      data_.rows.features.resize(usual_);
      return best;
    }
    rounds_ = variant;
    name_ = name;
    return error;
  }

  // One variant, stopped by one set of held-out rows.
  std::vector<SumPart> finish(BoostSummary& summary, Work& work) {
    const HoldOut& rows = data_.hold_outs.front();
    SumPart sum{.rate = rounds_.rate, .rounds = {}};
    const bool is_refitted = !data_.is_hold_out_given && refitted_part * std::ssize(rows.held_out) > y_.size();
    Work stopping(work, (is_refitted ? 0.4 : 1.0) * work.left());
    sum.rounds = boost(data_.rows, y_, rows.train, rows.held_out, {}, rounds_, random_, stopping);
    summary.rmse = sum.rounds.rmse * scale_;
    summary.held_out = std::ssize(rows.held_out);
    summary.rows = std::ssize(rows.train);
    residuals_ = sum.rounds.residuals;
    const bool is_tree_tried =
        y_.size() < enough_for_races || (y_.size() < most_rows_for_one && data_.x.cols() <= most_inputs_for_one &&
                                         sum.rounds.trees.size() <= most_trees_for_one);
    if (is_refitted) {
      summary.rows = y_.size();
      std::vector<int> all(y_.size());
      std::iota(all.begin(), all.end(), 0);
      RoundOptions more = rounds_;
      more.most_rounds = static_cast<int>(std::ceil(more_trees * static_cast<double>(sum.rounds.trees.size())));
      const bool keep = rounds_.tree.symmetric && y_.size() >= enough_for_races;
      const std::vector<GrowingTree> kept = keep ? sum.rounds.trees : std::vector<GrowingTree>();
      Work part(work, (is_tree_tried ? 0.7 : 1.0) * work.left());
      sum.rounds = boost(data_.rows, y_, all, {}, kept, more, random_, part);
    }
    summary.variant = name_;
    for (BoostVariant& variant : summary.compared) variant.share = variant.name == name_ ? 1.0 : 0.0;
    summary.train_rmse = sum.rounds.train_rmse * scale_;
    if (data_.is_hold_out_given || !is_tree_tried) return {sum};
    Work part(work, work.left());
    std::vector<BoostVariant> compared = std::move(summary.compared);
    for (BoostVariant& variant : compared) variant.share = 0.0;  // of 50 rounds, not of the sum
    // RD finds a sharp step that RA cannot see; RA is more accurate where all is smooth. A sum that stops early has no
    // steps left to find.
    std::vector<GrowthRule> rules = {GrowthRule::ra};
    if (y_.size() < enough_for_races) rules.push_back(GrowthRule::rd);
    std::vector<SumPart> parts =
        take(with_one_tree(data_, y_, {name_, std::move(sum)}, residuals_, rules, options_.max_threads, part), summary);
    summary.compared.insert(summary.compared.begin(), compared.begin(), compared.end());
    return parts;
  }

  // Few rows: every fold is held out in turn.
  std::vector<SumPart> finish_few(BoostSummary& summary, Work& work) {
    summary.rows = summary.held_out = y_.size();
    return take(blend(data_, y_, rounds_, options_.rate > 0.0, random_, work), summary);
  }

  std::vector<SumPart> take(Blend mean, BoostSummary& summary) {
    residuals_ = std::move(mean.residuals);
    summary.rmse = scale_ * mean.rmse;
    summary.train_rmse = scale_ * mean.train_rmse;
    if (mean.parts.size() > 1) summary.variant = "blend";
    summary.compared = std::move(mean.variants);
    for (BoostVariant& variant : summary.compared) {
      variant.rmse *= scale_;
      if (variant.share == 1.0) summary.variant = variant.name;
    }
    return std::move(mean.parts);
  }

  BoostingData& data_;
  const BoostOptions& options_;
  Random random_;
  Eigen::VectorXd y_;
  double mean_ = 0.0;
  double scale_ = 1.0;
  RoundOptions rounds_;
  std::string name_;
  Eigen::VectorXd residuals_;  // of held-out rows
  std::size_t usual_ = 0;      // features without pairs
};

}  // namespace

BoostResult fit_boosted(const TrainingData& data, const BoostOptions& options, const Progress& progress) {
  Work work(progress);
  BoostingData rows = boosting_data(data, options);
  const std::size_t features = rows.rows.features.size();
  std::vector<BoostedSum> sums;
  std::vector<BoostSummary> summaries;
  for (Eigen::Index output = 0; output < rows.y.cols(); ++output) {
    Work part(work, work.left() / static_cast<double>(rows.y.cols() - output));
    sums.push_back(OutputFit(rows, output, options).fit(summaries.emplace_back(), part));
    rows.rows.features.resize(features);
  }
  BoostResult result{BoostedModel(rows.inputs, rows.outputs, rows.deviations, std::move(sums)), std::move(summaries)};
  work.finish();
  return result;
}

}  // namespace llmt
