#include "growth/m5/tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>

#include "model/leaf_validities.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

// A node is not split if its outputs deviate by less than this part of those of all rows (Quinlan 1992).
constexpr double least_deviation = 0.05;

// The learned share of the left child in rows without a value starts from the share of the others, which counts as
// this many rows.
constexpr double prior_rows = 10.0;

class Grower {
 public:
  explicit Grower(const GrowthData& data) : data_(data), side_(data.training.count()) { tree_.weights = data.weights; }

  M5Tree run() {
    tree_.rows.resize(data_.training.count());
    std::iota(tree_.rows.begin(), tree_.rows.end(), 0);
    std::vector<std::pair<int, std::vector<Rows>>> open;  // nodes and the orders of their rows
    std::vector<Rows> orders(data_.split_inputs());
    for (std::size_t j = 0; j < orders.size(); ++j) {
      const Eigen::Index input = static_cast<Eigen::Index>(j);
      if (data_.num_levels[j] == 0) {
        std::ranges::copy_if(tree_.rows, std::back_inserter(orders[j]),
                             [&](int row) { return !std::isnan(data_.split_value(row, input)); });
        std::ranges::stable_sort(
            orders[j], [&](int a, int b) { return data_.split_value(a, input) < data_.split_value(b, input); });
      }
    }
    tree_.branches.resize(1);
    tree_.branches[0].end = std::ssize(tree_.rows);
    open.emplace_back(0, std::move(orders));
    while (!open.empty()) {
      auto [index, of_node] = std::move(open.back());
      open.pop_back();
      std::array<std::vector<Rows>, 2> of_children;
      if (split(index, of_node, of_children)) {
        const M5Branch& branch = tree_.branches[index];
        open.emplace_back(branch.left, std::move(of_children[0]));
        open.emplace_back(branch.right, std::move(of_children[1]));
      }
    }
    return std::move(tree_);
  }

 private:
  // False if the node stays a leaf. Sets the weights of its rows.
  bool split(std::size_t index, const std::vector<Rows>& orders, std::array<std::vector<Rows>, 2>& of_children) {
    M5Branch& branch = tree_.branches[index];
    const std::span<int> rows = tree_.rows_of(branch);
    const Rows own(rows.begin(), rows.end());
    const DeviationNode node{own, orders, tree_.weights};
    branch.tested.assign(data_.split_inputs(), false);
    for (const int row : own) {
      branch.weight += tree_.weights(row);
    }
    const double all = static_cast<double>(data_.outputs.cols());
    if (relative_deviation(data_, node) < least_deviation * all) return false;
    branch.split = largest_decrease(data_, node);
    if (branch.split.input < 0) return false;
    std::array<Rows, 3> sides;  // left, right, neither
    deal(branch, own, sides);
    branch.tested[branch.split.input] = true;
    Eigen::Index at = branch.begin;
    branch.left = static_cast<int>(tree_.branches.size());
    branch.right = branch.left + 1;
    std::array<M5Branch, 2> children;
    for (std::size_t side = 0; side < 3; ++side) {
      const Eigen::Index begin = at;
      at += std::ssize(sides[side]);
      std::ranges::copy(sides[side], tree_.rows.begin() + begin);
      if (side < 2) {
        children[side].parent = static_cast<int>(index);
        children[side].begin = begin;
        children[side].end = at;
      }
    }
    divide_orders(sides, orders, of_children);
    tree_.branches.push_back(std::move(children[0]));
    tree_.branches.push_back(std::move(children[1]));
    return true;
  }

  void divide_orders(const std::array<Rows, 3>& sides, const std::vector<Rows>& orders,
                     std::array<std::vector<Rows>, 2>& of_children) {
    for (std::size_t side = 0; side < 3; ++side) {
      for (const int row : sides[side]) {
        side_[row] = static_cast<signed char>(side);
      }
    }
    for (std::size_t side = 0; side < 2; ++side) {
      of_children[side].resize(orders.size());
      for (std::size_t j = 0; j < orders.size(); ++j) {
        std::ranges::copy_if(orders[j], std::back_inserter(of_children[side][j]),
                             [&](int row) { return side_[row] == static_cast<signed char>(side); });
      }
    }
  }

  // The rows of either child. Those without a value go to the child that has nearly all of them, if one has.
  void deal(M5Branch& branch, const Rows& rows, std::array<Rows, 3>& sides) {
    const DeviationSplit& split = branch.split;
    std::array<double, 2> weight{};
    for (const int row : rows) {
      const double value = data_.split_value(row, split.input);
      const std::size_t side = std::isnan(value)  ? (split.by_missing ? 1 : 2)
                               : split.by_missing ? 0
                               : !split.level_side.empty()
                                   ? (split.level_side[static_cast<std::size_t>(value)] < 0 ? 0 : 1)
                               : value <= split.threshold ? 0
                                                          : 1;
      sides[side].push_back(row);
      if (side < 2) {
        weight[side] += tree_.weights(row);
      }
    }
    branch.missing_left = split.by_missing ? 0.0 : learn_missing_left(sides, weight[0] / (weight[0] + weight[1]));
    for (const std::size_t side : {0U, 1U}) {
      const double share = side == 0 ? branch.missing_left : 1.0 - branch.missing_left;
      if (share >= clear_share && !sides[2].empty()) {
        for (const int row : sides[2]) {
          branch.shared.emplace_back(row, tree_.weights(row));
          tree_.weights(row) *= share;
          sides[side].push_back(row);
        }
        sides[2].clear();
        std::ranges::sort(sides[side]);
      }
    }
  }

  // Share of the left child in rows without a value that minimises their squared error under the means of the rows
  // that have one, drawn towards the share `known` of those; in [0, 1].
  double learn_missing_left(const std::array<Rows, 3>& sides, double known) const {
    std::array<Eigen::VectorXd, 2> mean;
    for (std::size_t side = 0; side < 2; ++side) {
      const Eigen::VectorXd weights = tree_.weights(sides[side]);
      mean[side] = data_.outputs(sides[side], Eigen::all).transpose() * weights / weights.sum();
    }
    const Eigen::VectorXd apart = mean[0] - mean[1];
    double squares = 0.0;
    double product = 0.0;
    double weight = 0.0;
    for (const int row : sides[2]) {
      const Eigen::VectorXd error = data_.outputs.row(row).transpose() - mean[1];
      squares += tree_.weights(row) * data_.output_weights.dot(apart.cwiseAbs2());
      product += tree_.weights(row) * data_.output_weights.dot(apart.cwiseProduct(error));
      weight += tree_.weights(row);
    }
    if (!(squares > 0.0)) return known;
    const double prior = prior_rows * squares / weight;
    return std::clamp((product + prior * known) / (squares + prior), 0.0, 1.0);
  }

  const GrowthData& data_;
  M5Tree tree_;
  std::vector<signed char> side_;  // of every row, while a node is split
};

}  // namespace

M5Tree grow_m5_tree(const GrowthData& data) { return Grower(data).run(); }

}  // namespace llmt
