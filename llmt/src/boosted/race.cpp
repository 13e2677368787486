#include "boosted/race.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "boosted/combined_features.hpp"

namespace llmt {
namespace {

// docs/benchmarks.md, "Sums of trees", says on which tables these were chosen.
constexpr int race_rounds = 50;
constexpr double race_rate = 0.3;
constexpr std::size_t most_paired = 4;       // inputs whose sums and differences are tried
constexpr std::size_t most_soft_paired = 6;  // and in soft trees, where these won
constexpr double allowed_at_first = 1.1;     // of the error: further features pay only after some hundred rounds
constexpr double allowed_when_turned = 1.05;
constexpr double fewest_looked_at = 8.0;  // features with pairs: half of them within these bounds
constexpr double most_looked_at = 16.0;
constexpr const char* of_pairs = " with pairs";
constexpr const char* of_directions = " with directions";
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

class Race {
 public:
  Race(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, std::uint64_t seed,
       Work& work)
      : data_(data),
        output_(output),
        usual_(usual),
        seed_(seed),
        work_(work),
        hold_outs_(hold_outs_of(data)),
        are_few_(data.regime.race == RaceRows::all_parts),
        best_{usual, "symmetric", data.rows},
        symmetric_(run_variant(best_)),
        least_(symmetric_) {}

  SumPlan winner() {
    const SumPlan first = best_;
    if (!are_few_) {
      SumPlan free = best_;
      free.name = "free";
      free.rounds.tree.symmetric = false;
      take_if(std::move(free), is_better_by(free_margin));
    }
    take_if(with_constants(best_), is_proven);
    if (const SumPlan paired = paired_with(most_paired, best_, data_.rows, symmetric_); has_more_features(paired)) {
      take_if(paired, is_better_by(0.0));
    }
    take_if(softened(best_, usual_), is_better_by(soft_margin));
    if (is_soft()) {
      const SumPlan paired = paired_with(most_soft_paired, best_, data_.rows, symmetric_);
      if (has_more_features(paired)) take_if(paired, is_below(allowed_at_first));
    }
    if (data_.regime.directions) turn(first);
    if (are_few_ && best_.name != first.name && error_at_the_end(first) < error_at_the_end(best_)) best_ = first;
    best_.compared = std::move(compared_);
    return std::move(best_);
  }

 private:
  using IsBetter = std::function<bool(const Raced&, const Raced&)>;

  const BoostingData& data_;
  const Eigen::VectorXd& output_;
  const RoundOptions& usual_;
  std::uint64_t seed_;
  Work& work_;
  std::vector<HoldOut> hold_outs_;
  bool are_few_;
  std::vector<BoostVariant> compared_;
  SumPlan best_;
  Raced symmetric_;  // symmetric trees, of inputs one by one
  Raced least_;      // of the best

  bool is_soft() const { return best_.rounds.tree.softness > 0.0; }

  Raced run_variant(const SumPlan& variant) {
    Work part(work_, 0.2);
    Raced raced = run(variant, output_, hold_outs_, seed_, part);
    compared_.push_back({variant.name, raced.rmse});
    return raced;
  }

  void take_if(SumPlan variant, const IsBetter& is_better) {
    Raced raced = run_variant(variant);
    if (!is_better(raced, least_)) return;
    least_ = std::move(raced);
    best_ = std::move(variant);
  }

  // `margin`: where the rows are many, the share of the error in units of 1 / sqrt(held-out rows).
  IsBetter is_better_by(double margin) const {
    return [=, are_few = are_few_](const Raced& one, const Raced& than) {
      const double noise = 1.0 / std::sqrt(static_cast<double>(one.residuals.size()));
      return are_few ? is_proven(one, than) : one.rmse < than.rmse * (1.0 - margin * noise);
    };
  }

  // `allowed`: where the rows are many, the largest share of the error.
  IsBetter is_below(double allowed) const {
    return [=, are_few = are_few_](const Raced& one, const Raced& than) {
      return are_few ? is_proven(one, than) : one.rmse < allowed * than.rmse;
    };
  }

  bool has_more_features(const SumPlan& plan) const { return plan.rows.features.size() > best_.rows.features.size(); }

  double looked_at(const BinnedRows& rows) const {
    const auto all = static_cast<double>(rows.features.size());
    const double half = std::clamp(0.5 * all, fewest_looked_at, most_looked_at);
    return std::min(1.0, std::max(half, static_cast<double>(data_.rows.features.size()) / 4.0) / all);
  }

  // The plan on `rows` with pairs of what symmetric trees on them use most; as it is without two features of numbers.
  SumPlan paired_with(std::size_t most, SumPlan plan, const BinnedRows& rows, const Raced& symmetric) const {
    const std::vector<int> used = most_used(rows, symmetric.trees, most);
    if (used.size() < 2) return plan;
    if (!plan.name.ends_with(of_pairs)) plan.name += of_pairs;
    plan.rows = with_pairs(data_, rows, used);
    plan.rounds.tree.columns = looked_at(plan.rows);
    return plan;
  }

  void turn(const SumPlan& first) {
    SumPlan crisp = first;
    crisp.rows = with_directions(data_, symmetric_.trees, least_.trees, best_.rows);
    if (crisp.rows.features.size() == data_.rows.features.size()) return;
    crisp.name += of_directions;
    crisp.rounds.tree.columns = looked_at(crisp.rows);
    Raced raced = run_variant(crisp);
    SumPlan soft = softened(paired_with(most_soft_paired, crisp, crisp.rows, raced), usual_);
    soft.name = std::string("soft") + of_directions;
    take_if(std::move(soft), is_soft() ? is_below(allowed_when_turned) : is_better_by(soft_margin));
    if (!is_soft() && is_better_by(soft_margin)(raced, least_)) best_ = std::move(crisp);
  }

  // A short race judges the start, and long ones of few rows are cheap.
  double error_at_the_end(const SumPlan& plan) const {
    const HoldOut& apart = data_.hold_outs.front();
    Random random(seed_);
    Work part(work_, 0.5 * work_.left());
    return boost(plan.rows, output_, apart.train, apart.held_out, {}, plan.rounds, random, part).rmse;
  }
};

}  // namespace

SumPlan race(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, std::uint64_t seed,
             Work& work) {
  return Race(data, output, usual, seed, work).winner();
}

}  // namespace llmt
