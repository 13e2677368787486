#include "growth/m5/tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>

#include "base/count.hpp"
#include "growth/missing_left.hpp"
#include "model/leaf_validities.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

// A node is not split if its outputs deviate by less than this part of the deviations of all rows (Quinlan 1992).
constexpr double least_deviation = 0.05;

enum class Side { left, right, none };

// Where a row goes that has `value` in the split input.
Side side_of(const DeviationSplit& split, double value) {
  if (std::isnan(value)) return split.by_missing ? Side::right : Side::none;
  if (split.by_missing) return Side::left;
  if (!split.level_side.empty()) {
    return split.level_side[static_cast<std::size_t>(value)] < 0 ? Side::left : Side::right;
  }
  return value <= split.threshold ? Side::left : Side::right;
}

// Rows of a node that go left, right and, without a value of the split input, to neither side.
struct Division {
  std::array<Rows, 3> rows;

  Rows& operator[](Side side) { return rows[static_cast<std::size_t>(side)]; }
  const Rows& operator[](Side side) const { return rows[static_cast<std::size_t>(side)]; }
};

// Rows by every numeric split input that have a value, ascending; empty for categories.
std::vector<Rows> sorted_rows(const GrowthData& data, const Rows& rows) {
  std::vector<Rows> orders(data.split_inputs());
  for (Eigen::Index j = 0; j < data.split_inputs(); ++j) {
    if (data.num_levels[j] > 0) continue;
    const auto value = [&](int row) { return data.split_value(row, j); };
    std::ranges::copy_if(rows, std::back_inserter(orders[j]), [&](int row) { return !std::isnan(value(row)); });
    std::ranges::stable_sort(orders[j], {}, value);
  }
  return orders;
}

// Node::missing_left by equation D.2 of docs/algorithms/data.md, with the means of the two sides as the children's
// models. `known`: the left side's part of the weight of the rows with a value.
double learn_missing_left(const GrowthData& data, const Eigen::VectorXd& row_weights, const Division& division,
                          double known) {
  const auto mean_of = [&](Side side) -> Eigen::VectorXd {
    const Eigen::VectorXd weights = row_weights(division[side]);
    return data.outputs(division[side], Eigen::all).transpose() * weights / weights.sum();
  };
  const Eigen::VectorXd right = mean_of(Side::right);
  const Eigen::VectorXd apart = mean_of(Side::left) - right;
  MissingSums sums;
  for (const int row : division[Side::none]) {
    const Eigen::VectorXd error = data.outputs.row(row).transpose() - right;
    sums.squares += row_weights(row) * data.output_weights.dot(apart.cwiseAbs2());
    sums.products += row_weights(row) * data.output_weights.dot(apart.cwiseProduct(error));
    sums.rows += 1.0;
  }
  return learned_missing_left(sums, known);
}

class Grower {
 public:
  explicit Grower(const GrowthData& data) : data_(data), side_(data.training.count()) { tree_.weights = data.weights; }

  M5Tree run();

 private:
  // One per split input.
  using Orders = std::vector<Rows>;

  bool split(std::size_t index, const Orders& orders, std::array<Orders, 2>& of_children);
  Division divide(M5Branch& branch, const Rows& rows);
  void share_missing(M5Branch& branch, Division& division);
  void divide_orders(const Division& division, const Orders& orders, std::array<Orders, 2>& of_children);

  const GrowthData& data_;
  M5Tree tree_;
  std::vector<Side> side_;  // of every row, while a node is split
};

M5Tree Grower::run() {
  tree_.rows.resize(data_.training.count());
  std::iota(tree_.rows.begin(), tree_.rows.end(), 0);
  tree_.branches.resize(1);
  tree_.branches[0].end = std::ssize(tree_.rows);
  std::vector<std::pair<int, Orders>> open;  // nodes and the orders of their rows
  open.emplace_back(0, sorted_rows(data_, tree_.rows));
  while (!open.empty()) {
    auto [index, of_node] = std::move(open.back());
    open.pop_back();
    std::array<Orders, 2> of_children;
    if (!split(index, of_node, of_children)) continue;
    const M5Branch& branch = tree_.branches[index];
    open.emplace_back(branch.left, std::move(of_children[0]));
    open.emplace_back(branch.right, std::move(of_children[1]));
  }
  return std::move(tree_);
}

// False if the node stays a leaf. Sets the weights of its rows.
bool Grower::split(std::size_t index, const Orders& orders, std::array<Orders, 2>& of_children) {
  M5Branch& branch = tree_.branches[index];
  const std::span<int> rows = tree_.rows_of(branch);
  const Rows own(rows.begin(), rows.end());
  const DeviationNode node{own, orders, tree_.weights};
  branch.tested.assign(data_.split_inputs(), false);
  for (const int row : own) {
    branch.weight += tree_.weights(row);
  }
  const double outputs = static_cast<double>(data_.outputs.cols());
  if (relative_deviation(data_, node) < least_deviation * outputs) return false;
  branch.split = largest_decrease(data_, node);
  data_.problem.searched(std::ssize(own));
  if (branch.split.input < 0) return false;
  const Division division = divide(branch, own);
  branch.tested[branch.split.input] = true;
  branch.left = count_of(tree_.branches);
  branch.right = branch.left + 1;
  std::array<M5Branch, 2> children;
  Eigen::Index at = branch.begin;
  for (const Side side : {Side::left, Side::right, Side::none}) {
    const Eigen::Index begin = at;
    at += std::ssize(division[side]);
    std::ranges::copy(division[side], tree_.rows.begin() + begin);
    if (side == Side::none) continue;
    M5Branch& child = children[side == Side::left ? 0 : 1];
    child.parent = static_cast<int>(index);
    child.begin = begin;
    child.end = at;
  }
  divide_orders(division, orders, of_children);
  tree_.branches.push_back(std::move(children[0]));
  tree_.branches.push_back(std::move(children[1]));
  return true;
}

// Sets missing_left.
Division Grower::divide(M5Branch& branch, const Rows& rows) {
  Division division;
  std::array<double, 3> weight{};
  for (const int row : rows) {
    const Side side = side_of(branch.split, data_.split_value(row, branch.split.input));
    division[side].push_back(row);
    weight[static_cast<std::size_t>(side)] += tree_.weights(row);
  }
  const double known = weight[0] / (weight[0] + weight[1]);
  branch.missing_left = branch.split.by_missing ? 0.0 : learn_missing_left(data_, tree_.weights, division, known);
  share_missing(branch, division);
  return division;
}

// Rows without a value go to the child that has nearly all of their validity, if one has.
void Grower::share_missing(M5Branch& branch, Division& division) {
  for (const Side side : {Side::left, Side::right}) {
    const double share = side == Side::left ? branch.missing_left : 1.0 - branch.missing_left;
    if (share < clear_share || division[Side::none].empty()) continue;
    for (const int row : division[Side::none]) {
      branch.shared.emplace_back(row, tree_.weights(row));
      tree_.weights(row) *= share;
      division[side].push_back(row);
    }
    division[Side::none].clear();
    std::ranges::sort(division[side]);
  }
}

void Grower::divide_orders(const Division& division, const Orders& orders, std::array<Orders, 2>& of_children) {
  for (const Side side : {Side::left, Side::right, Side::none}) {
    for (const int row : division[side]) {
      side_[row] = side;
    }
  }
  for (const Side side : {Side::left, Side::right}) {
    Orders& of_child = of_children[side == Side::left ? 0 : 1];
    of_child.resize(orders.size());
    for (std::size_t j = 0; j < orders.size(); ++j) {
      std::ranges::copy_if(orders[j], std::back_inserter(of_child[j]), [&](int row) { return side_[row] == side; });
    }
  }
}

}  // namespace

M5Tree grow_m5_tree(const GrowthData& data) { return Grower(data).run(); }

}  // namespace llmt
