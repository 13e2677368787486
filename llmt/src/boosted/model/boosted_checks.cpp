#include "boosted/model/boosted_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "llmt/limits.hpp"

namespace llmt {
namespace {

[[noreturn]] void fail(const std::string& pointer, const std::string& problem) { throw BoostedFault(pointer, problem); }

template <class Column>
void check_names_of(const char* list, const std::vector<Column>& columns) {
  std::set<std::string> seen;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (!seen.insert(columns[k].name).second) fail(fmt::format("/{}/{}", list, k), "its name is there twice");
    const bool is_range =
        std::isfinite(columns[k].low) && std::isfinite(columns[k].high) && columns[k].low <= columns[k].high;
    if (!is_range) fail(fmt::format("/{}/{}", list, k), "low and high are no range");
  }
}

void check_columns(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs,
                   const std::vector<double>& deviations) {
  if (inputs.empty()) fail("/inputs", "there is none");
  if (outputs.empty()) fail("/outputs", "there is none");
  check_names_of("inputs", inputs);
  check_names_of("outputs", outputs);
  if (deviations.size() != inputs.size()) fail("", "not one deviation an input");
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    const std::string pointer = fmt::format("/inputs/{}", j);
    if (!std::isfinite(inputs[j].centre)) fail(pointer, "centre is not finite");
    const double deviation = deviations[j];
    if (!std::isfinite(deviation) || deviation <= 0.0) fail(pointer, "deviation is not a positive number");
    if (!inputs[j].codes.empty()) fail(pointer, "a boosted model has no codes");
    const std::vector<std::string>& levels = inputs[j].levels;
    if (std::ssize(levels) > most(Limit::categories) + (inputs[j].has_empty_level() ? 1 : 0)) {
      fail(pointer, fmt::format("{} levels, at most {} are possible", levels.size(), most(Limit::categories)));
    }
    if (std::set<std::string>(levels.begin(), levels.end()).size() != levels.size()) {
      fail(pointer, "two levels have one name");
    }
  }
}

void check_feature(const BoostedFeature& feature, const std::vector<InputColumn>& inputs, const std::string& pointer) {
  const auto is_number = [&](int input) {
    return input >= 0 && input < std::ssize(inputs) && !inputs[input].is_categorical();
  };
  if (feature.level >= 0) {
    const int input = feature.inputs.size() == 1 ? feature.inputs.front() : -1;
    const bool exists = input >= 0 && input < std::ssize(inputs) && feature.level < std::ssize(inputs[input].levels);
    if (!exists) fail(pointer, "there is no such level");
    return;
  }
  if (feature.level != -1 || feature.inputs.empty()) fail(pointer, "it has no input");
  if (feature.factors.size() != feature.inputs.size()) fail(pointer, "not one factor an input");
  std::set<int> seen;
  for (std::size_t k = 0; k < feature.inputs.size(); ++k) {
    const int input = feature.inputs[k];
    if (!is_number(input)) fail(pointer, fmt::format("{} is no numeric input", input));
    if (!seen.insert(input).second) fail(pointer, fmt::format("input {} is there twice", input));
    if (!std::isfinite(feature.factors[k])) fail(pointer, "a factor is not finite");
  }
}

void check_leaf(const BoostedLeaf& leaf, std::size_t features, const std::string& pointer) {
  if (!std::isfinite(leaf.constant)) fail(pointer, "constant is not finite");
  if (!std::isfinite(leaf.low) || !std::isfinite(leaf.high) || leaf.low > leaf.high) {
    fail(pointer, "low and high are no range");
  }
  if (leaf.features.size() != leaf.slopes.size()) fail(pointer, "not one slope a feature");
  if (std::ssize(leaf.features) > most_leaf_slopes) {
    fail(pointer, fmt::format("more than {} slopes", most_leaf_slopes));
  }
  for (std::size_t k = 0; k < leaf.features.size(); ++k) {
    if (leaf.features[k] < 0 || std::cmp_greater_equal(leaf.features[k], features)) {
      fail(pointer, fmt::format("there is no feature {}", leaf.features[k]));
    }
    if (!std::isfinite(leaf.slopes[k])) fail(pointer, "a slope is not finite");
  }
  if (!leaf.means.empty() && leaf.means.size() != leaf.slopes.size()) fail(pointer, "not one mean a slope");
  if (!std::ranges::all_of(leaf.means, [](double mean) { return std::isfinite(mean); })) {
    fail(pointer, "a mean is not finite");
  }
}

// Every split but the first and every leaf is below one split, which stands before it: so all of them are reached.
void check_tree(const BoostedTree& tree, std::size_t features, const std::string& pointer) {
  if (tree.leaves.size() != tree.splits.size() + 1) fail(pointer, "a tree has one leaf more than splits");
  if (!(tree.smallest_share >= 0.0 && tree.smallest_share <= 0.5)) {
    fail(pointer, "smallest_share is not from 0 to 0.5");
  }
  std::vector<bool> split_seen(tree.splits.size(), false);
  std::vector<bool> leaf_seen(tree.leaves.size(), false);
  std::vector<int> splits_above(tree.splits.size(), 0);
  for (std::size_t k = 0; k < tree.splits.size(); ++k) {
    const BoostedSplit& split = tree.splits[k];
    const std::string of_split = fmt::format("{}/splits/{}", pointer, k);
    if (split.feature < 0 || std::cmp_greater_equal(split.feature, features)) {
      fail(of_split, fmt::format("there is no feature {}", split.feature));
    }
    if (!std::isfinite(split.threshold)) fail(of_split, "threshold is not finite");
    if (!std::isfinite(split.half_width) || split.half_width < 0.0) fail(of_split, "half_width is negative");
    if (!(split.missing_left >= 0.0 && split.missing_left <= 1.0)) fail(of_split, "missing_left is not from 0 to 1");
    for (const int child : {split.left, split.right}) {
      const bool is_leaf = child < 0;
      const std::size_t at = is_leaf ? -1 - static_cast<std::ptrdiff_t>(child) : child;
      std::vector<bool>& seen = is_leaf ? leaf_seen : split_seen;
      if (at >= seen.size() || (!is_leaf && at <= k)) fail(of_split, fmt::format("{} is no child", child));
      if (seen[at]) fail(of_split, fmt::format("{} is the child of two", child));
      seen[at] = true;
      if (splits_above[k] + 1 > most(Limit::model_splits_above_leaf)) {
        fail(of_split, fmt::format("the tree is deeper than {} splits", most(Limit::model_splits_above_leaf)));
      }
      if (!is_leaf) splits_above[at] = splits_above[k] + 1;
    }
  }
  for (std::size_t k = 0; k < tree.leaves.size(); ++k) {
    check_leaf(tree.leaves[k], features, fmt::format("{}/leaves/{}", pointer, k));
  }
}

void check_residuals(const std::vector<double>& residuals, const std::string& pointer) {
  double before = 0.0;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    if (!std::isfinite(residuals[k]) || residuals[k] < before) {
      fail(fmt::format("{}/residuals/{}", pointer, k), "residuals are not finite, negative or not ascending");
    }
    before = residuals[k];
  }
}

}  // namespace

void check_boosted(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs,
                   const std::vector<double>& deviations, const std::vector<BoostedSum>& sums) {
  check_columns(inputs, outputs, deviations);
  if (sums.size() != outputs.size()) fail("/sums", "not one sum an output");
  for (std::size_t o = 0; o < sums.size(); ++o) {
    const BoostedSum& sum = sums[o];
    const std::string pointer = fmt::format("/sums/{}", o);
    if (!std::isfinite(sum.base)) fail(pointer, "base is not finite");
    if (!std::isfinite(sum.rate) || sum.rate <= 0.0 || sum.rate > 1.0) fail(pointer, "rate is not in (0, 1]");
    for (std::size_t p = 0; p < sum.held_out.size(); ++p) {
      const std::string of_part = fmt::format("{}/held_out/{}", pointer, p);
      check_residuals(sum.held_out[p].residuals, of_part);
      try {
        check_spread(sum.held_out[p].spread, inputs);
      } catch (const std::invalid_argument& error) {
        fail(of_part, error.what());
      }
    }
    for (std::size_t k = 0; k < sum.features.size(); ++k) {
      check_feature(sum.features[k], inputs, fmt::format("{}/features/{}", pointer, k));
    }
    for (std::size_t k = 0; k < sum.trees.size(); ++k) {
      check_tree(sum.trees[k], sum.features.size(), fmt::format("{}/trees/{}", pointer, k));
    }
  }
}

}  // namespace llmt
