#include "explain/tree_game.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "boosted/model/boosted_checks.hpp"
#include "boosted/model/transition.hpp"
#include "llmt/limits.hpp"

namespace llmt {
namespace {

// In the k-th term of a leaf the mean of the feature stands in for a missing value.
double in_term(const BoostedLeaf& leaf, std::size_t k, double z) {
  return !std::isnan(z) ? z : leaf.means.empty() ? 0.0 : leaf.means[k];
}

// Whether a value lies within the transition of a split.
bool is_within(const BoostedSplit& split, double z) { return std::abs(z - split.threshold) < split.half_width; }

// A factor so small that a product with it may not be a normal number counts as none.
double without_dust(double factor) { return factor < 1e-290 ? 0.0 : factor; }

}  // namespace

TwoRows::TwoRows(const BoostedModel& model, const BoostedSum& sum, const double* x, const double* background,
                 Work& work)
    : work_(work), inputs_(model.num_inputs()), changes_(model.num_inputs(), 0.0) {
  for (Eigen::Index j = 0; j < model.num_inputs(); ++j) {
    const auto z = [&](const double* row) { return (row[j] - model.inputs()[j].centre) / model.deviations()[j]; };
    const bool same = x[j] == background[j] || (std::isnan(x[j]) && std::isnan(background[j]));
    inputs_[j] = {.standardised = {z(x), z(background)}, .differs = !same, .is_open = !same, .side = 0, .factors = {}};
  }
  for (const BoostedFeature& feature : sum.features) {
    features_.push_back({.is = feature,
                         .of = {feature_at(feature, model.inputs(), model.deviations(), x),
                                feature_at(feature, model.inputs(), model.deviations(), background)}});
  }
}

bool TwoRows::add_values(const BoostedTree& tree, const GameRule& rule, double scale,
                         Eigen::Ref<Eigen::VectorXd> values) {
  tree_ = &tree;
  rule_ = &rule;
  scale_ = scale;
  values_ = values.data();
  half_order_ = rule.row.size() / 2;
  level_ = 0;
  levels_.resize(std::max(levels_.size(), 3 * order()));
  std::fill_n(products(), order(), 1.0);
  std::fill_n(sums(), order(), 0.0);
  trials_ = 0;
  tasks_.push_back({Task::Kind::go, tree.splits.empty() ? -1 : 0, 1.0, -1, {}});
  while (!tasks_.empty()) {
    const Task task = tasks_.back();
    tasks_.pop_back();
    if (task.kind == Task::Kind::go_back) {
      go_back(task.input, task.factors);
      continue;
    }
    if (task.input >= 0) go_to(task.input, task.factors);
    walk(task.at, task.share);
    if (trials_ > most(Limit::sum_trials)) return false;
    constexpr std::int64_t steps_between_looks = 1024;
    if (++steps_ % steps_between_looks == 0) work_.check();
  }
  return true;
}

// The feature as the inputs have been decided; an input that is the same in both rows is of either.
double TwoRows::value(int feature) const {
  const auto& [is, of] = features_[feature];
  if (is.inputs.size() == 1) return of[inputs_[is.inputs.front()].side];
  double sum = 0.0;
  for (std::size_t k = 0; k < is.inputs.size(); ++k) {
    const Input& input = inputs_[is.inputs[k]];
    sum += is.factors[k] * input.standardised[input.side];
  }
  return sum;
}

// The open input whose factors changed last.
int TwoRows::last_open() const {
  return *std::find_if(touched_.rbegin(), touched_.rend(), [&](int input) { return inputs_[input].is_open; });
}

TwoRows::Open TwoRows::open_of(const BoostedFeature& feature) const {
  Open open;
  for (const int input : feature.inputs) {
    if (inputs_[input].is_open && open.count++ == 0) open.first = input;
  }
  return open;
}

// None where several inputs are open of which one is missing in a row: then the feature is missing for some of the
// ways.
std::optional<TwoRows::Ends> TwoRows::ends_of(const Feature& feature, const Open& open) const {
  const auto& [is, of] = feature;
  if (is.inputs.size() == 1) return Ends{{of[0], of[1]}};
  Ends ends{{0.0, 0.0}};
  for (std::size_t k = 0; k < is.inputs.size(); ++k) {
    const auto& [z, differs, is_open, side, factors] = inputs_[is.inputs[k]];
    if (is_open && open.count > 1 && (std::isnan(z[0]) || std::isnan(z[1]))) return std::nullopt;
    const double row = is.factors[k] * z[is_open ? 0 : side];
    const double background = is.factors[k] * z[is_open ? 1 : side];
    const bool is_turned = open.count > 1 && row > background;
    ends.z[0] += is_turned ? background : row;
    ends.z[1] += is_turned ? row : background;
  }
  return ends;
}

// The smallest and the largest share that may come to where the walk is, `share` times the factors so far.
TwoRows::Range TwoRows::range_of(double share) const {
  Range range{share, share};
  for (const int input : touched_) {
    const Factors& factors = inputs_[input].factors;
    const double larger = std::max(factors.row, factors.background);
    range.low *= inputs_[input].is_open ? std::min(factors.row, factors.background) : larger;
    range.high *= larger;
  }
  return range;
}

// How much of what comes to a split goes to the right. Where that depends on inputs that are open, nothing.
std::optional<double> TwoRows::right_of(const BoostedSplit& split, double z, double share) const {
  if (std::isnan(z)) return 1.0 - split.missing_left;
  const double crisp = z <= split.threshold ? 0.0 : 1.0;
  if (!is_within(split, z)) return crisp;
  const double right = share_of_right(z, split.threshold, split.half_width);
  if (tree_->smallest_share == 0.0) return right;
  const Range range = range_of(share);
  if (goes_both_ways(range.low, right, tree_->smallest_share)) return right;
  if (goes_both_ways(range.high, right, tree_->smallest_share)) return std::nullopt;
  return crisp;
}

void TwoRows::walk(int at, double share) {
  while (at >= 0) {
    const BoostedSplit& split = tree_->splits[at];
    const Open open = open_of(features_[split.feature].is);
    const std::optional<Ends> ends =
        open.count == 0 ? Ends{{value(split.feature), 0.0}} : ends_of(features_[split.feature], open);
    if (!ends) {
      decide(open.first, at, share);
      continue;
    }
    // What goes to the right grows with the feature, so where both ends agree all values between them do.
    double right[2];
    int known = 0;
    for (; known < (open.count == 0 ? 1 : 2); ++known) {
      const std::optional<double> found = right_of(split, ends->z[known], share);
      if (!found) break;
      right[known] = *found;
    }
    const bool differ = known == 2 && right[0] != right[1];
    if (known < (open.count == 0 ? 1 : 2)) {
      decide(last_open(), at, share);
    } else if (differ && open.count > 1) {
      decide(open.first, at, share);
    } else if (differ) {
      at = branch(split, share, open.first, {.row = right[0], .background = right[1]});
    } else {
      if (right[0] != 0.0 && right[0] != 1.0) {
        tasks_.push_back({Task::Kind::go, split.right, share * right[0], -1, {}});
        share *= 1.0 - right[0];
      }
      at = right[0] == 1.0 ? split.right : split.left;
    }
  }
  end_in(tree_->leaves[-1 - at], at, share);
}

// Goes on to the left of a split with the factors that the input has there, and later to the right. One of the sides
// may get nothing. Returns where to go on.
int TwoRows::branch(const BoostedSplit& split, double share, int input, const Factors& right) {
  const Factors& now = inputs_[input].factors;
  const auto scaled = [&](double row, double background) {
    return Factors{.row = without_dust(now.row * row), .background = without_dust(now.background * background)};
  };
  const Factors of_left = scaled(1.0 - right.row, 1.0 - right.background);
  const Factors of_right = scaled(right.row, right.background);
  const bool is_left = of_left.row != 0.0 || of_left.background != 0.0;
  if (is_left && (of_right.row != 0.0 || of_right.background != 0.0)) {
    tasks_.push_back({Task::Kind::go, split.right, share, input, of_right});
  }
  go_to(input, is_left ? of_left : of_right);
  return is_left ? split.left : split.right;
}

// Goes on from `at` with the input from the row, and later with it from the background.
void TwoRows::decide(int input, int at, double share) {
  ++trials_;
  const Factors now = inputs_[input].factors;
  tasks_.push_back({Task::Kind::go, at, share, input, {.row = 0.0, .background = now.background}});
  go_to(input, {.row = now.row, .background = 0.0});
}

// With q_i changed to q'_i, what comes to all leaves below adds the integral of its sum times
// (dq'_i / dp) / q'_i - (dq_i / dp) / q_i to the input's value. For a leaf, the changes on its path add up to the last.
void TwoRows::go_to(int input, const Factors& factors) {
  const Factors before = inputs_[input].factors;
  inputs_[input].set(factors);
  if (before.are_one()) touched_.push_back(input);
  tasks_.push_back({Task::Kind::go_back, 0, 0.0, input, before});
  ++level_;
  const std::size_t order = this->order();
  if (levels_.size() < 3 * order * (level_ + 1)) levels_.resize(2 * levels_.size() + 3 * order);
  const double* const p = rule_->row.data();
  const double* const rest = rule_->background.data();
  const double* const above = products() - 3 * order;
  double* const __restrict product = products();
  double* const __restrict weight = weights();
  double* const __restrict sum = sums();
  if (before.are_one() && (factors.row == 0.0 || factors.background == 0.0)) {  // as at crisp splits: no divisions
    const bool of_row = factors.row != 0.0;
    const double factor = of_row ? factors.row : factors.background;
    const double* const q = of_row ? p : rest;
    const double* const of_rule = of_row ? rule_->per_row.data() : rule_->per_background.data();
    for (std::size_t k = 0; k < order; ++k) {
      product[k] = above[k] * (factor * q[k]);
      weight[k] = of_rule[k];
      sum[k] = 0.0;
    }
    return;
  }
  for (std::size_t k = 0; k < order; ++k) {
    const double q = factors.row * p[k] + factors.background * rest[k];
    product[k] = above[k] * q;
    weight[k] = rule_->weights[k] * ((factors.row - factors.background) / q);
    sum[k] = 0.0;
  }
  if (before.are_one()) return;
  for (std::size_t k = 0; k < order; ++k) {
    const double q = before.row * p[k] + before.background * rest[k];
    product[k] /= q;
    weight[k] -= rule_->weights[k] * ((before.row - before.background) / q);
  }
}

void TwoRows::go_back(int input, const Factors& factors) {
  const std::size_t order = this->order();
  const double* const sum = sums();
  const double* const weight = weights();
  double* const __restrict above = sums() - 3 * order;
  double value = 0.0;
  for (std::size_t k = 0; k < order; ++k) value += weight[k] * sum[k];
  for (std::size_t k = 0; k < order; ++k) above[k] += sum[k];
  values_[input] += value;
  inputs_[input].set(factors);
  if (factors.are_one()) touched_.pop_back();
  --level_;
}

// A leaf within its limits is linear: its value if all open inputs are of the background, and a change for each of them
// that is of the row.
void TwoRows::end_in(const BoostedLeaf& leaf, int at, double share) {
  double value = 0.0;
  for (int input = deciding_input(leaf, value); input >= 0; input = deciding_input(leaf, value)) {
    decide(input, at, share);
  }
  const std::size_t order = this->order();
  const double* const p = rule_->row.data();
  const double* const product = products();
  double* const __restrict sum = sums();
  const double whole = scale_ * share;
  double integral = 0.0;  // of the product alone, which inputs have that no split has asked for
  for (std::size_t k = 0; k < order; ++k) integral += rule_->weights[k] * product[k];
  double slope = 0.0;  // of the leaf's value by p, from these inputs
  for (const int input : changing_) {
    const Factors& factors = inputs_[input].factors;
    const double change = whole * changes_[input];
    if (factors.are_one()) {
      values_[input] += change * integral;
      slope += change;
      continue;
    }
    double of_input = 0.0;
    for (std::size_t k = 0; k < order; ++k) {
      const double q = factors.row * p[k] + factors.background * rule_->background[k];
      const double of_row = change * product[k] * (factors.row / q);
      sum[k] += of_row * p[k];
      of_input += rule_->weights[k] * of_row * (factors.background / q);
    }
    values_[input] += of_input;
  }
  const double constant = whole * std::clamp(value, leaf.low, leaf.high);
  for (std::size_t k = 0; k < order; ++k) sum[k] += product[k] * (constant + slope * p[k]);
}

void TwoRows::forget_changes() {
  for (const int input : changing_) changes_[input] = 0.0;
  changing_.clear();
}

// The leaf's `value` with all open inputs from the background, and what each of them changes if it is from the row
// (changes_). An input to decide, if the leaf may reach its limits or is not a sum of what the inputs change; else -1.
int TwoRows::deciding_input(const BoostedLeaf& leaf, double& value) {
  forget_changes();
  const auto change = [&](int input, double by) {
    if (std::ranges::find(changing_, input) == changing_.end()) changing_.push_back(input);
    changes_[input] += by;
  };
  value = leaf.constant;
  for (std::size_t k = 0; k < leaf.features.size(); ++k) {
    const int feature = leaf.features[k];
    const auto& [is, of] = features_[feature];
    const Open open = open_of(is);
    if (open.count == 0) {
      value += leaf.slopes[k] * in_term(leaf, k, this->value(feature));
      continue;
    }
    if (is.inputs.size() == 1) {
      const double from = in_term(leaf, k, of[1]);
      value += leaf.slopes[k] * from;
      change(open.first, leaf.slopes[k] * (in_term(leaf, k, of[0]) - from));
      continue;
    }
    double sum = 0.0;
    for (std::size_t j = 0; j < is.inputs.size(); ++j) {
      const auto& [z, differs, is_open, side, factors] = inputs_[is.inputs[j]];
      sum += is.factors[j] * z[is_open ? 1 : side];
      const double by = is.factors[j] * (z[0] - z[1]);
      if (is_open && std::isnan(by)) return is.inputs[j];  // missing in one row: the feature is no sum
      if (is_open) change(is.inputs[j], leaf.slopes[k] * by);
    }
    if (std::isnan(sum)) return open.first;
    value += leaf.slopes[k] * sum;
  }
  double low = value;
  double high = value;
  for (const int input : changing_) (changes_[input] < 0.0 ? low : high) += changes_[input];
  if (low >= leaf.high || high <= leaf.low) {  // the limit, whatever the inputs
    value = low >= leaf.high ? leaf.high : leaf.low;
    forget_changes();
  }
  const bool is_within = low >= leaf.low && high <= leaf.high;
  return is_within || changing_.empty()
             ? -1
             : *std::ranges::max_element(changing_, {}, [&](int input) { return std::abs(changes_[input]); });
}

}  // namespace llmt
