// Where a local model that several leaves of an older file share is guarded.
#include "model/shared_leaves.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "llmt/random.hpp"
#include "model/tree.hpp"

namespace {

using Shared = std::vector<std::optional<int>>;

// A tree that grows by splitting random leaves.
llmt::Partition random_tree(int leaves, llmt::Random& random) {
  llmt::Partition tree;
  tree.nodes.resize(1);
  while (tree.num_leaves() < leaves) {
    const auto at = static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(tree.nodes.size())));
    if (!tree.nodes[at].is_leaf()) continue;
    tree.nodes[at].left = static_cast<int>(tree.nodes.size());
    tree.nodes[at].right = tree.nodes[at].left + 1;
    tree.nodes.resize(tree.nodes.size() + 2);
  }
  return tree;
}

std::vector<int> path_from(int node, const std::vector<int>& parents) {
  std::vector<int> path;
  for (; node >= 0; node = parents[node]) path.push_back(node);
  return path;
}

TEST(SharedLeaves, AreGuardedAtTheLowestNodeAboveThemAll) {
  llmt::Random random(1);
  for (int round = 0; round < 200; ++round) {
    llmt::Partition tree = random_tree(12, random);
    const std::vector<int> parents = llmt::parents_of(tree);
    std::map<int, std::vector<int>> groups;  // by their first leaf
    Shared shared(tree.nodes.size());
    for (int i = 0; i < static_cast<int>(tree.nodes.size()); ++i) {
      if (!tree.nodes[i].is_leaf()) continue;
      const auto some = static_cast<std::size_t>(random.uniform(0.0, 6.0));
      if (some < groups.size()) {
        const auto group = std::next(groups.begin(), static_cast<std::ptrdiff_t>(some));
        group->second.push_back(i);
        shared[i] = group->first;
      } else {
        groups[i] = {i};
      }
    }
    llmt::set_guard_parents(tree, shared);
    for (const auto& [first, leaves] : groups) {
      // The first node on the way up that is above every leaf.
      int expected = -1;
      for (const int candidate : path_from(first, parents)) {
        const bool above_all = std::ranges::all_of(leaves, [&](int leaf) {
          const std::vector<int> path = path_from(leaf, parents);
          return std::ranges::find(path, candidate) != path.end();
        });
        if (above_all && leaves.size() > 1) {
          expected = candidate;
          break;
        }
      }
      for (const int leaf : leaves) EXPECT_EQ(tree.nodes[leaf].guard_parent, expected) << "round " << round;
    }
  }
}

TEST(SharedLeaves, ALongChainTakesTimeInProportionToItsLength) {
  constexpr int splits = 300'000;
  llmt::Partition chain;
  chain.nodes.resize(2 * splits + 1);
  for (int k = 0; k < splits; ++k) {
    llmt::Node& node = chain.nodes[k == 0 ? 0 : 2 * k];
    node.left = 2 * k + 1;
    node.right = 2 * k + 2;
  }
  Shared shared(chain.nodes.size());
  for (int k = 1; k < splits; ++k) shared[2 * k + 1] = 1;
  llmt::set_guard_parents(chain, shared);
  EXPECT_EQ(chain.nodes[2 * splits - 1].guard_parent, 0);
  EXPECT_EQ(chain.nodes[2 * splits].guard_parent, -1);
}

TEST(SharedLeaves, NodesThatAreNoTreeAreLeftToModel) {
  llmt::Partition diamond;  // every node is both children of the one before
  diamond.nodes.resize(60);
  for (int i = 0; i + 1 < 60; ++i) diamond.nodes[i].left = diamond.nodes[i].right = i + 1;
  llmt::set_guard_parents(diamond, Shared(60));
  EXPECT_EQ(diamond.nodes[59].guard_parent, -1);
}

}  // namespace
