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

// A step that has more rules than another and not this much less error is none.
constexpr double least_gain_of_step = 0.01;

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

// The size by which a tree is called short: its own, or that which half of the trees of its key have where that is
// larger. A tree that is by chance shorter than those whose errors are known is not what they say.
Eigen::Index size_for_choice(const ComparedTree& tree, const TreeExtent& own) {
  std::vector<Eigen::Index> sizes;
  for (const TreeExtent& extent : tree.extents) sizes.push_back(extent.size);
  const auto middle = sizes.begin() + std::ssize(sizes) / 2;
  std::ranges::nth_element(sizes, middle);
  return std::max(own.size, *middle);
}

// The trees of one number of rules.
struct Group {
  std::vector<std::size_t> trees;
  double smallest = infinity;
};

}  // namespace

std::size_t Path::with_rules(Eigen::Index most, bool paying) const {
  std::size_t found = 0;
  for (std::size_t step = 0; step < steps.size() && rules[step] <= most; ++step) {
    if (pays[step] || !paying) found = step;
  }
  return found;
}

Path path_of(const std::vector<ComparedTree>& trees, const PathRule& rule, int left_out) {
  const auto extent_of = [&](std::size_t i) -> const TreeExtent& {
    return left_out < 0 ? trees[i].extents.back() : trees[i].extents[left_out];
  };
  std::vector<double> errors;
  std::vector<Eigen::Index> sizes;
  std::map<Eigen::Index, Group> groups;
  double equation = infinity;  // the best single one without products
  Path path{.steps = {}, .rules = {}, .pays = {}, .chosen = 0, .yardstick = infinity, .is_within_loss = true};
  for (std::size_t i = 0; i < trees.size(); ++i) {
    const double error = errors.emplace_back(error_without(trees[i].squares, rule.weights, left_out));
    sizes.push_back(size_for_choice(trees[i], extent_of(i)));
    Group& group = groups[extent_of(i).rules];
    group.trees.push_back(i);
    group.smallest = std::min(group.smallest, error);
    // Products are there to make trees smaller, not to ask more of them.
    if (trees[i].has_products) continue;
    path.yardstick = std::min(path.yardstick, error);
    if (extent_of(i).rules == 1) equation = std::min(equation, error);
  }
  for (const std::vector<double>& squares : rule.crisp_squares)
    path.yardstick = std::min(path.yardstick, error_without(squares, rule.weights, left_out));
  const auto shortest = [&](const std::vector<std::size_t>& among, const auto& is_good) {
    const auto rank = [&](std::size_t i) { return std::tuple(sizes[i], trees[i].key.form, errors[i]); };
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
    chosen = static_cast<std::size_t>(std::ranges::min_element(errors) - errors.begin());
  }
  double smallest = infinity;
  for (const auto& [rules, group] : groups) {
    const bool is_chosen = extent_of(chosen).rules == rules;
    const double most = std::max((1.0 + tolerance_of_step) * group.smallest, rule.least);
    const std::size_t step =
        is_chosen ? chosen : shortest(group.trees, [&](std::size_t i) { return errors[i] <= most; });
    if (is_chosen) path.chosen = path.steps.size();
    path.steps.push_back(step);
    path.rules.push_back(rules);
    path.pays.push_back(is_chosen || errors[step] < (1.0 - least_gain_of_step) * smallest);
    smallest = std::min(smallest, errors[step]);
  }
  return path;
}

}  // namespace llmt
