#include "readable/path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace llmt {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// A step is the shortest tree with its number of rules whose error is at most this much above the smallest there.
constexpr double tolerance_of_step = 0.02;

double error_without(const std::vector<double>& squares, const std::vector<double>& weights, int left_out) {
  double sum = 0.0;
  double weight = 0.0;
  for (int f = 0; f < static_cast<int>(squares.size()); ++f) {
    if (f == left_out) continue;
    sum += squares[f];
    weight += weights[f];
  }
  return std::sqrt(sum / weight);
}

// The errors of a key are those of its folds' trees. They say what a tree costs that is like these: with as many rules
// as the middle one of its key, and no shorter than the middle one. One that is shorter by chance is another tree.
bool is_like_the_others(const ComparedTree& tree, const TreeExtent& own) {
  const auto middle_of = [&](Eigen::Index TreeExtent::*part) {
    std::vector<Eigen::Index> values;
    for (const TreeExtent& extent : tree.extents) values.push_back(extent.*part);
    const auto middle = values.begin() + std::ssize(values) / 2;
    std::ranges::nth_element(values, middle);
    return *middle;
  };
  return own.rules == middle_of(&TreeExtent::rules) && own.size >= middle_of(&TreeExtent::size);
}

// The trees of one number of rules.
struct Group {
  std::vector<std::size_t> trees;
  double smallest = infinity;
};

}  // namespace

std::size_t Path::with_rules(Eigen::Index most) const {
  std::size_t found = 0;
  for (std::size_t step = 0; step < steps.size() && rules[step] <= most; ++step) found = step;
  return found;
}

Path path_of(const std::vector<ComparedTree>& trees, const PathRule& rule, int left_out) {
  const auto extent_of = [&](std::size_t i) -> const TreeExtent& {
    return left_out < 0 ? trees[i].extents.back() : trees[i].extents[left_out];
  };
  std::vector<double> errors;
  std::map<Eigen::Index, Group> groups;
  double equation = infinity;  // the best single one without products: sparse least squares
  Path path{.steps = {}, .rules = {}, .chosen = 0, .yardstick = infinity, .is_within_loss = true};
  for (std::size_t i = 0; i < trees.size(); ++i) {
    const double error = errors.emplace_back(error_without(trees[i].squares, rule.weights, left_out));
    if (is_like_the_others(trees[i], extent_of(i))) {
      Group& group = groups[extent_of(i).rules];
      group.trees.push_back(i);
      group.smallest = std::min(group.smallest, error);
    }
    // Products are there to make trees smaller, not to ask more of them.
    if (trees[i].has_products) continue;
    path.yardstick = std::min(path.yardstick, error);
    if (std::ranges::all_of(trees[i].extents, [](const TreeExtent& extent) { return extent.rules == 1; }))
      equation = std::min(equation, error);
  }
  for (const std::vector<double>& squares : rule.crisp_squares)
    path.yardstick = std::min(path.yardstick, error_without(squares, rule.weights, left_out));
  const auto shortest = [&](const std::vector<std::size_t>& among, const auto& is_good) {
    const auto rank = [&](std::size_t i) { return std::tuple(extent_of(i).size, trees[i].key.form, errors[i]); };
    std::size_t best = trees.size();
    for (const std::size_t i : among) {
      if (is_good(i) && (best == trees.size() || rank(i) < rank(best))) best = i;
    }
    return best;
  };
  const double limit = (1.0 + rule.loss) * std::max(path.yardstick, rule.least);
  std::size_t chosen = trees.size();
  for (const auto& [rules, group] : groups) {
    const double by_equation = (rules == 1 ? 1.0 + tolerance_of_step : 1.0) * equation;
    const double most = std::min(limit, std::max(by_equation, rule.least));
    const std::size_t best = shortest(group.trees, [&](std::size_t i) { return errors[i] <= most; });
    if (best == trees.size()) continue;
    chosen = chosen == trees.size() ? best : shortest({chosen, best}, [](std::size_t) { return true; });
  }
  path.is_within_loss = chosen < trees.size();
  if (!path.is_within_loss) {
    for (const auto& [rules, group] : groups) {
      for (const std::size_t i : group.trees) {
        if (chosen == trees.size() || errors[i] < errors[chosen]) chosen = i;
      }
    }
  }
  for (const auto& [rules, group] : groups) {
    const bool is_chosen = extent_of(chosen).rules == rules;
    const double most = std::max((1.0 + tolerance_of_step) * group.smallest, rule.least);
    if (is_chosen) path.chosen = path.steps.size();
    path.steps.push_back(is_chosen ? chosen : shortest(group.trees, [&](std::size_t i) { return errors[i] <= most; }));
    path.rules.push_back(rules);
  }
  return path;
}

}  // namespace llmt
