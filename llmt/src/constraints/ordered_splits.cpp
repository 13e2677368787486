#include "constraints/ordered_splits.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>

#include "constraints/leaf_geometry.hpp"

namespace llmt {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// A split is moved if its margin is below this part of the one that is asked for. So splits that the estimate left with
// about the margin asked for are not moved for rounding's sake.
constexpr double tolerated_part_of_margin = 0.5;

}  // namespace

OrderedSplits::OrderedSplits(const Partition& partition, const TrainingRows& training, Eigen::Index output)
    : below_(partition.nodes.size()), children_(partition.nodes.size(), {-1, -1}) {
  for (int i = count_of(partition.nodes); i-- > 0;) {
    const Node& node = partition.nodes[i];
    if (node.is_leaf()) {
      below_[i] = {i};
      continue;
    }
    children_[i] = {node.left, node.right};
    below_[i] = below_[node.left];
    below_[i].insert(below_[i].end(), below_[node.right].begin(), below_[node.right].end());
  }
  pairs_ = leaf_pairs(LeafGeometry(partition, training, output), partition, below_);
}

OrderedSplits::Worst OrderedSplits::worst(const LeafPairs::Pair& pair, const Eigen::MatrixXd& models) const {
  Worst result{.margin = pair.sign * (models(0, pair.right) - models(0, pair.left)), .coefficient = {}, .options = {}};
  for (Eigen::Index g = pair.inputs.first; g < pair.inputs.first + pair.inputs.count; ++g) {
    const LeafPairs::Range& options = pairs_.inputs[g];
    double smallest = infinity;
    Eigen::Index chosen = options.first;
    for (Eigen::Index i = options.first; i < options.first + options.count; ++i) {
      const LeafPairs::Option& option = pairs_.options[i];
      double value = option.constant;
      for (Eigen::Index t = option.terms.first; t < option.terms.first + option.terms.count; ++t) {
        const LeafPairs::Term& term = pairs_.terms[t];
        value +=
            models(1 + term.regressor, pair.right) * term.right - models(1 + term.regressor, pair.left) * term.left;
      }
      if (pair.sign * value < smallest) {
        smallest = pair.sign * value;
        chosen = i;
      }
    }
    result.margin += smallest;
    result.options.push_back(pairs_.options[chosen]);
  }
  const double left = pair.regressor < 0 ? 0.0 : pair.sign * models(1 + pair.regressor, pair.left);
  const double right = pair.regressor < 0 ? 0.0 : pair.sign * models(1 + pair.regressor, pair.right);
  double least = infinity;
  for (Eigen::Index i = pair.coefficients.first; i < pair.coefficients.first + pair.coefficients.count; ++i) {
    const LeafPairs::Coefficient& each = pairs_.coefficients[i];
    const double value = each.of_left * left + each.of_right * right;
    if (value < least) {
      least = value;
      result.coefficient = each;
    }
  }
  result.margin += least;
  return result;
}

LeafInequality OrderedSplits::inequality(const LeafPairs::Pair& pair, const Worst& worst, Eigen::Index size,
                                         double margin) const {
  LeafInequality result{pair.left, pair.right, Eigen::VectorXd::Zero(size), Eigen::VectorXd::Zero(size), margin};
  result.of_left(0) = -pair.sign;
  result.of_right(0) = pair.sign;
  for (const LeafPairs::Option& option : worst.options) {
    result.bound -= pair.sign * option.constant;
    for (Eigen::Index t = option.terms.first; t < option.terms.first + option.terms.count; ++t) {
      const LeafPairs::Term& term = pairs_.terms[t];
      result.of_left(1 + term.regressor) -= pair.sign * term.left;
      result.of_right(1 + term.regressor) += pair.sign * term.right;
    }
  }
  if (pair.regressor >= 0) {
    result.of_left(1 + pair.regressor) += pair.sign * worst.coefficient.of_left;
    result.of_right(1 + pair.regressor) += pair.sign * worst.coefficient.of_right;
  }
  return result;
}

std::vector<LeafInequality> OrderedSplits::violated(const Eigen::MatrixXd& models, double least, double margin) const {
  std::map<std::array<int, 3>, std::pair<double, std::size_t>> worst_of;  // of split, side and leaf: margin, pair
  for (std::size_t p = 0; p < pairs_.pairs.size(); ++p) {
    const LeafPairs::Pair& pair = pairs_.pairs[p];
    const double here = worst(pair, models).margin;
    if (!(here < least)) continue;
    for (const auto& key : {std::array<int, 3>{pair.split, 0, pair.left}, {pair.split, 1, pair.right}}) {
      const auto [entry, is_new] = worst_of.try_emplace(key, here, p);
      if (here < entry->second.first) {
        entry->second = {here, p};
      }
    }
  }
  std::set<std::size_t> chosen;
  for (const auto& [key, entry] : worst_of) {
    chosen.insert(entry.second);
  }
  std::vector<LeafInequality> result;
  for (const std::size_t p : chosen) {
    const LeafPairs::Pair& pair = pairs_.pairs[p];
    result.push_back(inequality(pair, worst(pair, models), models.rows(), margin));
  }
  return result;
}

double OrderedSplits::smallest_margin(const Eigen::MatrixXd& models) const {
  double least = infinity;
  for (const LeafPairs::Pair& pair : pairs_.pairs) {
    least = std::min(least, worst(pair, models).margin);
  }
  return least;
}

void OrderedSplits::separate(Eigen::MatrixXd& models, double margin) const {
  const std::vector<LeafPairs::Pair>& pairs = pairs_.pairs;
  for (std::size_t first = 0; first < pairs.size();) {
    const LeafPairs::Pair& pair = pairs[first];
    double least = infinity;
    std::size_t next = first;
    for (; next < pairs.size() && pairs[next].split == pair.split; ++next) {
      least = std::min(least, worst(pairs[next], models).margin);
    }
    if (least < tolerated_part_of_margin * margin) {
      const double move = 0.5 * pair.sign * (margin - least);
      const auto [left, right] = children_[pair.split];
      for (const int leaf : below_[left]) {
        models(0, leaf) -= move;
      }
      for (const int leaf : below_[right]) {
        models(0, leaf) += move;
      }
    }
    first = next;
  }
}

}  // namespace llmt
