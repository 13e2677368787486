#include "estimation/merging.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <set>
#include <tuple>

#include "model/tree.hpp"

namespace llmt {
namespace {

/// Ridge that makes every system solvable, relative to the columns' sums of squares: directions without rows stay at
/// the root's model, the others lose nothing that is visible in a rise.
constexpr double least_ridge = 1e-10;

using LevelSet = std::vector<bool>;  // empty: all

/// Levels of every categorical input that reach a node.
using Levels = std::vector<LevelSet>;

std::vector<Levels> levels_of_nodes(const Partition& partition, std::size_t inputs) {
  std::vector<Levels> result(partition.nodes.size(), Levels(inputs));
  for (std::size_t i = 0; i < partition.nodes.size(); ++i) {
    const Node& node = partition.nodes[i];
    if (node.is_leaf()) {
      continue;
    }
    const std::size_t left = static_cast<std::size_t>(node.left);
    const std::size_t right = static_cast<std::size_t>(node.right);
    result[left] = result[right] = result[i];
    if (node.level_side.empty()) {
      continue;
    }
    const std::size_t input = static_cast<std::size_t>(node.split_input);
    for (const auto& [child, away] : {std::pair{left, 1}, std::pair{right, -1}}) {
      LevelSet& levels = result[child][input];
      levels.resize(node.level_side.size(), true);
      for (std::size_t level = 0; level < levels.size(); ++level) {
        levels[level] = (result[i][input].empty() || result[i][input][level]) && node.level_side[level] != away;
      }
    }
  }
  return result;
}

bool overlap(const LevelSet& a, const LevelSet& b) {
  if (a.empty() || b.empty()) {
    return true;
  }
  for (std::size_t level = 0; level < a.size(); ++level) {
    if (a[level] && b[level]) {
      return true;
    }
  }
  return false;
}

/// Local models of groups of leaves, about the root's, and what it costs to join two.
class Groups {
 public:
  Groups(const NormalEquations& sums, const std::vector<int>& leaves, const Eigen::VectorXd& weights)
      : weights_(weights) {
    for (const int leaf : leaves) {
      const std::size_t node = static_cast<std::size_t>(leaf);
      grams_.push_back(sums.gram[node]);
      products_.push_back(sums.products[node]);
      models_.push_back(solve(grams_.back(), products_.back()));
    }
  }

  double rise(std::size_t a, std::size_t b) const {
    const Eigen::MatrixXd model = solve(grams_[a] + grams_[b], products_[a] + products_[b]);
    double sum = 0.0;
    for (const std::size_t group : {a, b}) {
      const Eigen::MatrixXd change = models_[group] - model;
      sum += weights_.dot(change.cwiseProduct(grams_[group] * change).colwise().sum().transpose());
    }
    return std::max(sum, 0.0);
  }

  void join(std::size_t kept, std::size_t merged) {
    grams_[kept] += grams_[merged];
    products_[kept] += products_[merged];
    models_[kept] = solve(grams_[kept], products_[kept]);
  }

 private:
  static Eigen::MatrixXd solve(Eigen::MatrixXd gram, const Eigen::MatrixXd& products) {
    gram.diagonal() += (least_ridge * gram.diagonal()).cwiseMax(std::numeric_limits<double>::min());
    return gram.llt().solve(products);
  }

  const Eigen::VectorXd& weights_;
  std::vector<Eigen::MatrixXd> grams_;
  std::vector<Eigen::MatrixXd> products_;
  std::vector<Eigen::MatrixXd> models_;
};

/// A pair of groups, as they were after so many merges of each.
struct Pair {
  float rise;  // in single precision, so that rises equal but for rounding count as equal
  std::size_t first;
  std::size_t second;
  int version;  // of both together
  double exact;
  bool operator>(const Pair& other) const {
    return std::tie(rise, first, second) > std::tie(other.rise, other.first, other.second);
  }
};

}  // namespace

std::vector<std::pair<int, int>> touching_leaves(const Partition& partition, const std::vector<int>& leaves) {
  int inputs = 0;
  for (const Node& node : partition.nodes) {
    inputs = std::max(inputs, node.split_input + 1);
  }
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const Boxes boxes =
      boxes_of(partition, Eigen::VectorXd::Constant(inputs, -infinity), Eigen::VectorXd::Constant(inputs, infinity));
  const std::vector<Levels> levels = levels_of_nodes(partition, static_cast<std::size_t>(inputs));
  const std::vector<int> parents = parents_of(partition);
  // Two leaves lie on different sides of the split of the smallest subtree that holds both, and can touch only there.
  const auto touch = [&](int a, int b) {
    int left = a;
    int right = b;
    while (parents[static_cast<std::size_t>(left)] != parents[static_cast<std::size_t>(right)]) {
      int& lower = left > right ? left : right;
      lower = parents[static_cast<std::size_t>(lower)];
    }
    const Node& split = partition.nodes[static_cast<std::size_t>(parents[static_cast<std::size_t>(left)])];
    if (left > right) {
      std::swap(a, b);
    }
    for (int j = 0; j < inputs; ++j) {
      if (j == split.split_input) {
        const bool on_number = split.level_side.empty() && split.threshold < std::numeric_limits<double>::max();
        if (on_number && (boxes.high(j, a) != split.threshold || boxes.low(j, b) != split.threshold)) {
          return false;
        }
      } else if (!(std::max(boxes.low(j, a), boxes.low(j, b)) < std::min(boxes.high(j, a), boxes.high(j, b))) ||
                 !overlap(levels[static_cast<std::size_t>(a)][static_cast<std::size_t>(j)],
                          levels[static_cast<std::size_t>(b)][static_cast<std::size_t>(j)])) {
        return false;
      }
    }
    return true;
  };
  std::vector<std::pair<int, int>> result;
  for (std::size_t a = 0; a < leaves.size(); ++a) {
    for (std::size_t b = a + 1; b < leaves.size(); ++b) {
      if (touch(leaves[a], leaves[b])) {
        result.emplace_back(static_cast<int>(a), static_cast<int>(b));
      }
    }
  }
  return result;
}

std::vector<Merge> merge_sequence(const Partition& partition, const NormalEquations& sums,
                                  const Eigen::VectorXd& weights) {
  const std::vector<int>& leaves = sums.leaves;
  Groups groups(sums, leaves, weights);
  std::vector<std::set<std::size_t>> neighbours(leaves.size());
  std::vector<int> version(leaves.size(), 0);  // -1: merged into another
  std::priority_queue<Pair, std::vector<Pair>, std::greater<>> queue;
  const auto enter = [&](std::size_t a, std::size_t b) {
    const double rise = groups.rise(a, b);
    queue.push({static_cast<float>(rise), std::min(a, b), std::max(a, b), version[a] + version[b], rise});
  };
  for (const auto& [a, b] : touching_leaves(partition, leaves)) {
    neighbours[static_cast<std::size_t>(a)].insert(static_cast<std::size_t>(b));
    neighbours[static_cast<std::size_t>(b)].insert(static_cast<std::size_t>(a));
    enter(static_cast<std::size_t>(a), static_cast<std::size_t>(b));
  }
  std::vector<Merge> result;
  while (!queue.empty()) {
    const Pair next = queue.top();
    queue.pop();
    const std::size_t kept = next.first;
    const std::size_t merged = next.second;
    if (version[kept] < 0 || version[merged] < 0 || version[kept] + version[merged] != next.version) {
      continue;
    }
    result.push_back({leaves[kept], leaves[merged], next.exact});
    groups.join(kept, merged);
    version[kept] += version[merged] + 1;
    version[merged] = -1;
    for (const std::size_t other : neighbours[merged]) {
      neighbours[other].erase(merged);
      if (other != kept) {
        neighbours[other].insert(kept);
        neighbours[kept].insert(other);
      }
    }
    neighbours[kept].erase(merged);
    neighbours[merged].clear();
    for (const std::size_t other : neighbours[kept]) {
      enter(kept, other);
    }
  }
  return result;
}

int rank_of(const Eigen::MatrixXd& gram) {
  // The constant explains part of every column: what is left of them in units of their own sums of squares.
  const double total = gram(0, 0);
  if (!(total > 0.0)) {
    return 0;
  }
  const std::ptrdiff_t columns = gram.rows() - 1;
  Eigen::MatrixXd centred =
      gram.bottomRightCorner(columns, columns) - gram.col(0).tail(columns) * gram.row(0).tail(columns) / total;
  Eigen::VectorXd scale(columns);
  for (std::ptrdiff_t k = 0; k < columns; ++k) {
    const double squares = gram(k + 1, k + 1);
    scale(k) = centred(k, k) > 1e-12 * squares && squares > 0.0 ? 1.0 / std::sqrt(centred(k, k)) : 0.0;
  }
  if (columns == 0) {
    return 1;
  }
  centred = scale.asDiagonal() * centred * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(centred, Eigen::EigenvaluesOnly);
  const double largest = eigen.eigenvalues().maxCoeff();
  return 1 + static_cast<int>((eigen.eigenvalues().array() > 1e-10 * largest).count() * (largest > 0.0 ? 1 : 0));
}

}  // namespace llmt
