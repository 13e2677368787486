// The order in which splits are undone.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "growth/pruning.hpp"
#include "llmt/random.hpp"
#include "oracles/random_trees.hpp"

namespace {

using namespace random_trees;

// A tree whose splits carry their number as threshold, and gains that are zero for leaves.
struct Tree {
  std::vector<llmt::Node> nodes;
  std::vector<double> gains;
};

Tree random_tree(llmt::Random& random, int splits) {
  Tree tree{{llmt::Node{}}, {0.0}};
  for (int k = 0; k < splits; ++k) {
    std::size_t at = random.below(tree.nodes.size());
    while (!tree.nodes[at].is_leaf()) {
      at = random.below(tree.nodes.size());
    }
    tree.nodes[at].left = static_cast<int>(tree.nodes.size());
    tree.nodes[at].right = tree.nodes[at].left + 1;
    tree.nodes[at].split_input = 0;
    tree.nodes[at].threshold = static_cast<double>(at);
    tree.gains[at] = random.uniform(-0.1, 1.0);
    tree.nodes.resize(tree.nodes.size() + 2);
    tree.gains.resize(tree.nodes.size(), 0.0);
  }
  return tree;
}

// Splits, by their numbers, in the order of the nodes that they made.
std::vector<int> order_of(const std::vector<llmt::Node>& nodes) {
  std::vector<int> order(nodes.size() / 2);
  for (const llmt::Node& node : nodes) {
    if (!node.is_leaf()) {
      order[(node.left - 1) / 2] = static_cast<int>(node.threshold);
    }
  }
  return order;
}

double sum_over_prefixes(const std::vector<int>& order, const std::vector<double>& gains) {
  double gain = 0.0;
  double sum = 0.0;
  for (const int split : order) {
    gain += gains[split];
    sum += gain;
  }
  return sum;
}

// Calls visit(order) for every order of splits in which each stands behind the one above it.
void for_each_order(const Tree& tree, std::vector<int>& order, std::set<int> open,
                    const std::function<void(const std::vector<int>&)>& visit) {
  visit(order);
  for (const int split : open) {
    std::set<int> rest = open;
    rest.erase(split);
    const llmt::Node& node = tree.nodes[split];
    for (const int child : {node.left, node.right}) {
      if (!tree.nodes[child].is_leaf()) {
        rest.insert(child);
      }
    }
    order.push_back(split);
    for_each_order(tree, order, rest, visit);
    order.pop_back();
  }
}

TEST(WeakestLink, SumOfTheSquaresOfAllPrunedTreesIsTheLeastOfAllOrders) {
  llmt::Random random(1);
  for (int trial = 0; trial < 60; ++trial) {
    const Tree tree = random_tree(random, 1 + trial % 7);
    const std::vector<llmt::Node> found = llmt::in_pruning_order(tree.nodes, tree.gains);
    ASSERT_EQ(found.size(), tree.nodes.size());
    const std::vector<int> own = order_of(found);
    double best = -1e9;
    bool is_an_order = false;
    std::vector<int> order;
    for_each_order(tree, order, {0}, [&](const std::vector<int>& each) {
      if (each.size() == own.size()) {
        best = std::max(best, sum_over_prefixes(each, tree.gains));
        is_an_order = is_an_order || each == own;
      }
    });
    EXPECT_TRUE(is_an_order);
    EXPECT_NEAR(sum_over_prefixes(own, tree.gains), best, 1e-6);
  }
}

TEST(WeakestLink, EveryCostComplexityTreeIsAPrefix) {
  llmt::Random random(2);
  for (int trial = 0; trial < 60; ++trial) {
    const Tree tree = random_tree(random, 1 + trial % 7);
    const std::vector<int> own = order_of(llmt::in_pruning_order(tree.nodes, tree.gains));
    for (double cost = -0.2; cost < 1.1; cost += 0.05) {  // of a split
      double best = -1e9;
      std::vector<int> kept;
      std::vector<int> order;
      for_each_order(tree, order, {0}, [&](const std::vector<int>& each) {
        double gain = 0.0;
        for (const int split : each) {
          gain += tree.gains[split] - cost;
        }
        if (gain > best + 1e-12) {
          best = gain;
          kept = each;
        }
      });
      std::vector<int> prefix(own.begin(), own.begin() + std::ssize(kept));
      std::ranges::sort(prefix);
      std::ranges::sort(kept);
      EXPECT_EQ(prefix, kept) << "cost " << cost;
    }
  }
}

TEST(WeakestLink, TheWholeTreeStaysTheSameUnderEveryRuleAndValidity) {
  for (const llmt::GrowthRule rule : {llmt::GrowthRule::rd, llmt::GrowthRule::retis, llmt::GrowthRule::lolimot,
                                      llmt::GrowthRule::lolimot_data_driven}) {
    for (const std::size_t kind : {0, 1, 4}) {
      const Data d = data(5);
      llmt::FitOptions options = only(kinds[kind], llmt::Estimation::local, 12);
      options.rule = rule;
      options.max_leaves = 0;
      options.min_leaf_samples = 25;
      options.shared_partition = kind == 1;
      const llmt::Model grown = llmt::fit(d.x, d.y, options).model;
      options.pruning = llmt::Pruning::weakest_link;
      const llmt::Model ordered = llmt::fit(d.x, d.y, options).model;
      const Eigen::MatrixXd query = 0.9 * oracle::uniform(200, 3, 6);  // beyond the rows the first 32 leaves count
      ASSERT_GT(grown.partitions()[0].num_leaves(), 4);
      EXPECT_LT((ordered.predict(query) - grown.predict(query)).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

TEST(WeakestLink, PrunedTreesOfAFitLeaveLessThanThoseOfTheOrderOfGrowth) {
  double less = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Data d = data(seed);
    llmt::FitOptions options = only(kinds[0], llmt::Estimation::as_grown, 0);
    options.min_leaf_samples = 10;
    const auto left = [&] {
      const llmt::Model model = llmt::fit(d.x, d.y.col(0), options).model;
      double sum = 0.0;
      for (Eigen::Index leaves = 1; leaves <= model.partitions()[0].num_leaves(); ++leaves) {
        const llmt::Model pruned = model.prefix(leaves);
        for (const llmt::Node& node : pruned.partitions()[0].nodes) {
          sum += node.is_leaf() ? node.rss(0) : 0.0;
        }
      }
      return sum;
    };
    options.pruning = llmt::Pruning::last_splits;
    const double grown = left();
    options.pruning = llmt::Pruning::weakest_link;
    const double pruned = left();
    EXPECT_LE(pruned, grown * (1.0 + 1e-12));
    less += grown - pruned;
  }
  EXPECT_GT(less, 0.0);
}

// Where x1 < -1/2 noise of standard deviation 3; elsewhere the signs of x2 and x3 multiplied, noise 0.1: the first
// split there gains next to nothing, the second and third nearly all.
Data signs_beside_noise(std::uint64_t seed, Eigen::Index rows) {
  llmt::Random random(seed);
  Data d{oracle::uniform(rows, 3, seed), Eigen::MatrixXd(rows, 2)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const bool noisy = d.x(i, 0) < -0.5;
    d.y(i, 1) = noisy ? -5.0 : std::copysign(1.0, d.x(i, 1)) * std::copysign(1.0, d.x(i, 2));  // the truth
    d.y(i, 0) = d.y(i, 1) + (noisy ? 3.0 : 0.1) * random.normal();
  }
  return d;
}

TEST(WeakestLink, FirstSplitThatGainsNothingStaysForThoseBelowIt) {
  const Data test = signs_beside_noise(99, 2000);
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const Data d = signs_beside_noise(seed, 2000);
    llmt::FitOptions options;
    options.validity = llmt::ValidityChoice::crisp;
    options.regression_inputs = {0};  // signs are no slopes
    options.intervals = false;
    const auto error = [&] {
      return llmt::rmse(llmt::fit(d.x, d.y.col(0), options).model.predict(test.x), test.y.col(1))(0);
    };
    const double with_test = error();
    options.significance = 1.0;
    const double last_splits = error();
    options.significance = -1.0;
    options.pruning = llmt::Pruning::weakest_link;
    const double weakest_link = error();
    // Where the signs are not found, three quarters of the rows have an error of 1: 0.87 in all.
    EXPECT_GT(with_test, 0.8);
    EXPECT_GT(last_splits, 0.8);
    EXPECT_LT(weakest_link, 0.5);
  }
}

TEST(WeakestLink, NoiseIsLeftToLeastSquares) {
  int split = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Eigen::MatrixXd x = oracle::uniform(150, 2, seed);
    llmt::Random random(seed);
    Eigen::MatrixXd y(150, 1);
    for (double& value : y.reshaped()) {
      value = random.normal();
    }
    llmt::FitOptions options;
    options.pruning = llmt::Pruning::weakest_link;
    options.validity = llmt::ValidityChoice::crisp;
    split += llmt::fit(x, y, options).summary.partitions[0].leaves > 1 ? 1 : 0;
  }
  // A gain of two standard errors over five folds has a probability of 6 % by chance: more than 4 of 20 of 0.6 %.
  EXPECT_LE(split, 4);
}

}  // namespace
