#include "explain/tree_game.hpp"

#include <algorithm>
#include <cmath>

#include "boosted/model/boosted_checks.hpp"
#include "boosted/model/transition.hpp"

namespace llmt {
namespace {

// In linear terms a missing value counts as z = 0.
double in_terms(double z) { return std::isnan(z) ? 0.0 : z; }

// The way of a row at a split. A row that goes both ways has a third one.
enum class Way { left, right, both };

Way way_of(const BoostedSplit& split, double z) {
  if (std::isnan(z)) return split.missing_left ? Way::left : Way::right;
  if (std::abs(z - split.threshold) < split.half_width) return Way::both;
  return z <= split.threshold ? Way::left : Way::right;
}

}  // namespace

TwoRows::TwoRows(const BoostedModel& model, const BoostedSum& sum, const double* x, const double* background)
    : inputs_(model.num_inputs()), changes_(model.num_inputs(), 0.0) {
  for (Eigen::Index j = 0; j < model.num_inputs(); ++j) {
    const auto z = [&](const double* row) { return (row[j] - model.inputs()[j].centre) / model.deviations()[j]; };
    const bool same = x[j] == background[j] || (std::isnan(x[j]) && std::isnan(background[j]));
    inputs_[j] = {.standardised = {z(x), z(background)}, .differs = !same, .source = Source::open};
  }
  for (const BoostedFeature& feature : sum.features) {
    features_.push_back({.is = feature,
                         .of = {feature_at(feature, model.inputs(), model.deviations(), x),
                                feature_at(feature, model.inputs(), model.deviations(), background)}});
  }
}

void TwoRows::add_values(const BoostedTree& tree, double scale, Eigen::Ref<Eigen::VectorXd> values) {
  tree_ = &tree;
  scale_ = scale;
  values_ = values.data();
  walk(tree.splits.empty() ? -1 : 0, 1.0);
}

// The feature as the inputs have been decided; an input that is the same in both rows is of either.
double TwoRows::value(int feature) const {
  const BoostedFeature& is = features_[feature].is;
  const auto of_row = [&](int input) { return inputs_[input].source != Source::background; };
  if (is.second < 0) return value(feature, of_row(is.first));
  const auto z = [&](int input) { return inputs_[input].standardised[of_row(input) ? 0 : 1]; };
  return z(is.first) + is.sign * z(is.second);
}

// The first input of the feature that differs and is not decided; -1: none.
int TwoRows::first_open(int feature) const {
  const BoostedFeature& is = features_[feature].is;
  if (is_open(is.first)) return is.first;
  return is.second >= 0 && is_open(is.second) ? is.second : -1;
}

// True if both rows go the same way, so that it does not matter from which one the input is taken.
bool TwoRows::is_same_way(const BoostedSplit& split) const {
  if (features_[split.feature].is.second >= 0) return false;
  const Way way = way_of(split, value(split.feature, true));
  return way != Way::both && way == way_of(split, value(split.feature, false));
}

void TwoRows::walk(int at, double share) {
  while (at >= 0) {
    const BoostedSplit& split = tree_->splits[at];
    const int open = first_open(split.feature);
    if (open >= 0 && !is_same_way(split)) {
      decide(open, at, share);
      return;
    }
    const double z = value(split.feature);
    const Way way = way_of(split, z);
    if (way == Way::both) {
      const double right = share_of_right(z, split.threshold, split.half_width);
      if (goes_both_ways(share, right, tree_->smallest_share)) {
        walk(split.left, share * (1.0 - right));
        share *= right;
        at = split.right;
        continue;
      }
    }
    at = way == Way::left || (way == Way::both && z <= split.threshold) ? split.left : split.right;
  }
  end_in(tree_->leaves[-1 - at], at, share);
}

// Goes on from `at` with the input from the one row, then from the other.
void TwoRows::decide(int input, int at, double share) {
  inputs_[input].source = Source::row;
  of_row_.push_back(input);
  walk(at, share);
  of_row_.pop_back();
  inputs_[input].source = Source::background;
  of_background_.push_back(input);
  walk(at, share);
  of_background_.pop_back();
  inputs_[input].source = Source::open;
}

void TwoRows::end_in(const BoostedLeaf& leaf, int at, double share) {
  double value = 0.0;
  if (const int input = deciding_input(leaf, value); input >= 0) {
    decide(input, at, share);
    return;
  }
  add(share * std::clamp(value, leaf.low, leaf.high));
  // Within the limits the leaf is a sum of games in which one more input is of the row.
  for (const int input : changing_) add(share * changes_[input], input);
}

// The leaf's `value` with all open inputs from the background, and what each of them changes if it is from the row
// (changes_). An input to decide, if the leaf may reach its limits or is not a sum of what the inputs change; else -1.
int TwoRows::deciding_input(const BoostedLeaf& leaf, double& value) {
  for (const int input : changing_) changes_[input] = 0.0;
  changing_.clear();
  const auto change = [&](int input, double by) {
    if (std::ranges::find(changing_, input) == changing_.end()) changing_.push_back(input);
    changes_[input] += by;
  };
  value = leaf.constant;
  for (std::size_t k = 0; k < leaf.features.size(); ++k) {
    const int feature = leaf.features[k];
    const int open = first_open(feature);
    const BoostedFeature& is = features_[feature].is;
    if (open < 0) {
      value += leaf.slopes[k] * in_terms(this->value(feature));
      continue;
    }
    if (is.second < 0) {
      const double from = in_terms(this->value(feature, false));
      value += leaf.slopes[k] * from;
      change(open, leaf.slopes[k] * (in_terms(this->value(feature, true)) - from));
      continue;
    }
    double sum = 0.0;
    for (const int input : {is.first, is.second}) {
      const Input& of = inputs_[input];
      const double factor = input == is.first ? 1.0 : is.sign;
      const bool is_undecided = is_open(input);
      sum += factor * of.standardised[is_undecided || of.source == Source::background ? 1 : 0];
      const double by = factor * (of.standardised[0] - of.standardised[1]);
      if (is_undecided && std::isnan(by)) return input;  // missing in one row: the pair is no sum
      if (is_undecided) change(input, leaf.slopes[k] * by);
    }
    if (std::isnan(sum)) return open;
    value += leaf.slopes[k] * sum;
  }
  double low = value;
  double high = value;
  for (const int input : changing_) (changes_[input] < 0.0 ? low : high) += changes_[input];
  const bool is_within = low >= leaf.low && high <= leaf.high;
  return is_within || changing_.empty() ? -1 : changing_.front();
}

// The game v(S) = value [A in S] [B and S disjoint], with A the inputs of the row, and `more`, and B those of the
// background: an input of A gets value (a - 1)! b! / (a + b)!, one of B -value a! (b - 1)! / (a + b)!.
void TwoRows::add(double value, int more) {
  const auto a = static_cast<double>(of_row_.size() + (more >= 0 ? 1 : 0));
  const auto b = static_cast<double>(of_background_.size());
  if (a + b == 0.0) return;
  double orders = 1.0;  // (a + b)! / (a! b!)
  for (double k = 1.0; k <= std::min(a, b); k += 1.0) orders *= (std::max(a, b) + k) / k;
  const double each = scale_ * value / orders;
  for (const int input : of_row_) values_[input] += each / a;
  if (more >= 0) values_[more] += each / a;
  for (const int input : of_background_) values_[input] -= each / b;
}

}  // namespace llmt
