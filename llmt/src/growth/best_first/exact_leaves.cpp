#include "growth/best_first/exact_leaves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/parallel.hpp"
#include "growth/best_first/residual_search.hpp"
#include "model/evaluator.hpp"

namespace llmt {
namespace {

using Rows = std::vector<int>;

// The learned share of the left child in rows without a value starts from the share of the others, which counts as
// this many rows.
constexpr double prior_rows = 10.0;

struct ValueOfRow {
  double value;
  int position;
  bool operator<(const ValueOfRow& other) const {
    return value != other.value ? value < other.value : position < other.position;
  }
};

}  // namespace

double ExactLeaves::split_value(const ExactLeaf& leaf, Eigen::Index row, Eigen::Index split_input) const {
  return leaf.inputs(row, data_.problem.options.split_inputs[split_input]);
}

RowMajor ExactLeaves::deviations(const ExactLeaf& leaf) const {
  const std::vector<Regressor>& regressors = data_.training.regressors;
  RowMajor result(leaf.inputs.rows(), std::ssize(regressors));
  for (Eigen::Index row = 0; row < result.rows(); ++row) {
    deviations_at(data_.training.columns, regressors, leaf.inputs.row(row).data(), result.row(row).data());
  }
  return result;
}

ExactLeaf ExactLeaves::open(const Rows& rows, const Node& parent) const {
  ExactLeaf leaf;
  leaf.inputs = inputs_of(data_.training, rows);
  leaf.weights = data_.weights(rows);
  // Missing values are taken at the mean of the parent's rows, as they were in its fit.
  RowMajor x = deviations(leaf);
  if (data_.training.has_missing) {
    x = x.array().isNaN().select(parent.mean.transpose().replicate(x.rows(), 1), x).eval();
  }
  leaf.residuals = data_.outputs(rows, Eigen::all) - x * parent.slope.transpose();
  leaf.residuals.rowwise() -= parent.value.transpose();
  leaf.orders.resize(data_.split_inputs());
  parallel_for(data_.split_inputs(), data_.threads_for(std::ssize(rows)), [&](Eigen::Index j) {
    if (data_.num_levels[j] > 0 || by_signs()) return;
    std::vector<ValueOfRow> values;
    values.reserve(rows.size());
    for (Eigen::Index k = 0; k < leaf.inputs.rows(); ++k) {
      if (const double value = split_value(leaf, k, j); !std::isnan(value)) {
        values.push_back({value, static_cast<int>(k)});
      }
    }
    std::sort(values.begin(), values.end());
    Rows& order = leaf.orders[j];
    order.resize(values.size());
    std::ranges::transform(values, order.begin(), [](const ValueOfRow& entry) { return entry.position; });
  });
  return leaf;
}

SplitCandidate ExactLeaves::examine(ExactLeaf& leaf, const Node& parent, Node& node) const {
  const RowMajor x = deviations(leaf);
  const NodeFit fit = data_.training.has_missing
                          ? fit_node(x, about_own_mean(x, parent, leaf.residuals, leaf.weights), leaf.weights)
                          : fit_node(x, leaf.residuals, leaf.weights);
  node.samples = leaf.inputs.rows();
  node.rank = fit.rank;
  node.rss = fit.rss;
  node.value = parent.value + fit.centre_change;
  node.slope = parent.slope + fit.slope_change;
  node.mean = fit.mean;
  node.low = fit.low;
  node.high = fit.high;
  leaf.residuals = fit.residuals();
  return find_split(leaf, fit, data_.output_weights.dot(node.rss));
}

// Residuals of the parent's local model with missing values at the mean of these rows instead of the parent's.
Eigen::MatrixXd ExactLeaves::about_own_mean(const RowMajor& deviations, const Node& parent, Eigen::MatrixXd residuals,
                                            const Eigen::VectorXd& weights) const {
  for (Eigen::Index k = 0; k < deviations.cols(); ++k) {
    double sum = 0.0;
    double present = 0.0;
    for (Eigen::Index i = 0; i < deviations.rows(); ++i) {
      if (!std::isnan(deviations(i, k))) {
        sum += weights(i) * deviations(i, k);
        present += weights(i);
      }
    }
    const double mean = present > 0.0 ? sum / present : 0.0;
    for (Eigen::Index i = 0; i < deviations.rows(); ++i) {
      if (std::isnan(deviations(i, k))) {
        residuals.row(i) += parent.slope.col(k).transpose() * (parent.mean(k) - mean);
      }
    }
  }
  return residuals;
}

// Level of each row of the leaf in a categorical split input, -1 where it is missing.
std::vector<int> ExactLeaves::levels_of(const ExactLeaf& leaf, Eigen::Index split_input) const {
  std::vector<int> levels;
  for (Eigen::Index row = 0; row < leaf.inputs.rows(); ++row) {
    const double value = split_value(leaf, row, split_input);
    levels.push_back(std::isnan(value) ? -1 : static_cast<int>(value));
  }
  return levels;
}

SplitCandidate ExactLeaves::find_split(const ExactLeaf& leaf, const NodeFit& fit, double rss) const {
  SplitCandidate best;
  const Eigen::Index smallest_leaf = data_.problem.options.min_leaf_samples;
  if (leaf.inputs.rows() < 2 * smallest_leaf) return best;
  const SearchNode node{fit.features, data_.output_weights, rss};
  if (by_signs()) return find_split_by_signs(leaf, node, fit.rank);
  const std::size_t inputs = leaf.orders.size();
  const int threads = data_.threads_for(leaf.inputs.rows() * data_.split_inputs());
  std::vector<std::optional<InputSearch>> searches(inputs);
  std::vector<SplitCandidate> found(inputs);
  parallel_for(std::ssize(found), threads, [&](Eigen::Index j) {
    const std::size_t slot = j;
    if (data_.num_levels[slot] > 0) {
      found[slot] = search_levels(node, levels_of(leaf, j), data_.num_levels[slot], smallest_leaf);
      return;
    }
    const Rows& order = leaf.orders[slot];
    std::vector<double> values(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      values[k] = split_value(leaf, order[k], j);
    }
    searches[slot].emplace(node, std::move(values), order, smallest_leaf);
    searches[slot]->search_edges();
  });
  // What one input has found spares the others work, in a way that does not depend on who was first.
  double limit = std::numeric_limits<double>::infinity();
  Eigen::Index numeric = 0;  // candidate splits on numbers
  for (std::size_t j = 0; j < inputs; ++j) {
    limit = std::min(limit, searches[j] ? searches[j]->smallest() : limit);
    numeric += searches[j] ? searches[j]->tested() : 0;
  }
  limit = std::min(limit, data_.significant_rss(leaf.weights.sum(), fit.rank, rss, numeric));
  parallel_for(std::ssize(found), threads, [&](Eigen::Index j) {
    const std::size_t slot = j;
    if (searches[slot]) {
      searches[slot]->refine(limit);
      found[slot] = searches[slot]->best();
      if (std::ssize(leaf.orders[slot]) < leaf.inputs.rows()) {
        consider_missing(node, leaf, j, found[slot]);
      }
      searches[slot].reset();
    }
  });
  return first_of_best(found, rss);
}

// The inputs' thresholds by the signs of the residuals; categories, and that a value is missing, as in the exact
// search.
SplitCandidate ExactLeaves::find_split_by_signs(const ExactLeaf& leaf, const SearchNode& node, int rank) const {
  Rows rows(leaf.inputs.rows());
  std::iota(rows.begin(), rows.end(), 0);
  const int threads = data_.threads_for(leaf.inputs.rows() * data_.split_inputs());
  const Eigen::MatrixXd values = leaf.inputs(Eigen::all, data_.problem.options.split_inputs);
  SignSplit numeric = search_by_signs(data_, {node, rank, rows, values, leaf.residuals, leaf.weights, {}, threads});
  std::vector<SplitCandidate> found(leaf.orders.size());
  parallel_for(std::ssize(found), threads, [&](Eigen::Index j) {
    const std::size_t slot = j;
    if (numeric.best.input == j) {
      found[slot] = std::move(numeric.best);
    }
    if (data_.num_levels[slot] > 0) {
      found[slot] =
          search_levels(node, levels_of(leaf, j), data_.num_levels[slot], data_.problem.options.min_leaf_samples);
    } else if (values.col(j).hasNaN()) {
      consider_missing(node, leaf, j, found[slot]);
    }
  });
  return first_of_best(found, node.rss);
}

// Takes the split into rows with and without a value if it is better: that a value is missing can say something.
void ExactLeaves::consider_missing(const SearchNode& node, const ExactLeaf& leaf, Eigen::Index j,
                                   SplitCandidate& best) const {
  std::vector<int> is_missing;
  for (Eigen::Index row = 0; row < leaf.inputs.rows(); ++row) {
    is_missing.push_back(std::isnan(split_value(leaf, row, j)) ? 1 : 0);
  }
  SplitCandidate candidate = search_levels(node, is_missing, 2, data_.problem.options.min_leaf_samples);
  const Eigen::Index tested = best.tested + candidate.tested;
  if (candidate.input >= 0 && (best.input < 0 || candidate.rss < best.rss - tie_tolerance * node.rss)) {
    best = std::move(candidate);
    best.level_side.clear();
    best.by_missing = true;
  }
  best.tested = tested;
}

// Where the best split of a leaf sends its rows.
std::vector<ExactLeaves::Side> ExactLeaves::sides_of(const ExactLeaf& leaf, const SplitCandidate& split) const {
  std::vector<Side> sides(leaf.inputs.rows(), Side::both);
  if (split.by_missing) {
    for (std::size_t k = 0; k < sides.size(); ++k) {
      sides[k] = std::isnan(split_value(leaf, k, split.input)) ? Side::right : Side::left;
    }
    return sides;
  }
  if (data_.num_levels[split.input] > 0) {
    const std::vector<int> levels = levels_of(leaf, split.input);
    for (std::size_t k = 0; k < sides.size(); ++k) {
      if (levels[k] >= 0) {
        sides[k] = split.level_side[levels[k]] < 0 ? Side::left : Side::right;
      }
    }
    return sides;
  }
  if (by_signs()) {
    for (std::size_t k = 0; k < sides.size(); ++k) {
      const double value = split_value(leaf, k, split.input);
      sides[k] = value <= split.last_left ? Side::left : std::isnan(value) ? Side::both : Side::right;
    }
    return sides;
  }
  const Rows& order = leaf.orders[split.input];
  for (std::size_t k = 0; k < order.size(); ++k) {
    sides[order[k]] = static_cast<Eigen::Index>(k) < split.left ? Side::left : Side::right;
  }
  return sides;
}

// Share of the left child in rows that have no value for the split: the one that minimises their squared error
// under the local models of the rows that have one, drawn towards the share of those; in [0, 1].
double ExactLeaves::learn_missing_left(const ExactLeaf& leaf, const Node& parent,
                                       const std::vector<Side>& sides) const {
  std::array<Rows, 3> positions;
  std::array<double, 3> weight{};
  for (std::size_t k = 0; k < sides.size(); ++k) {
    positions[static_cast<std::size_t>(sides[k])].push_back(static_cast<int>(k));
    weight[static_cast<std::size_t>(sides[k])] += leaf.weights(static_cast<Eigen::Index>(k));
  }
  const double known = weight[0] / (weight[0] + weight[1]);
  const Rows& missing = positions[2];
  if (missing.empty()) return known;
  const RowMajor all = deviations(leaf);
  const RowMajor queries = all(missing, Eigen::all);
  std::array<Eigen::MatrixXd, 2> change;  // child's prediction minus the leaf's, rows x outputs
  for (std::size_t side = 0; side < 2; ++side) {
    const RowMajor of_child = all(positions[side], Eigen::all);
    const Eigen::VectorXd weights = leaf.weights(positions[side]);
    const Eigen::MatrixXd residuals =
        about_own_mean(of_child, parent, leaf.residuals(positions[side], Eigen::all), weights);
    const NodeFit fit = fit_node(of_child, residuals, weights);
    change[side] = fit.centre_change.transpose().replicate(queries.rows(), 1);
    for (Eigen::Index i = 0; i < queries.rows(); ++i) {
      for (Eigen::Index k = 0; k < queries.cols(); ++k) {
        if (std::isnan(queries(i, k))) {
          change[side].row(i) +=
              (fit.slope_change.col(k) * fit.mean(k) + parent.slope.col(k) * (fit.mean(k) - parent.mean(k)))
                  .transpose();
        } else {
          change[side].row(i) += fit.slope_change.col(k).transpose() * queries(i, k);
        }
      }
    }
  }
  const Eigen::MatrixXd apart = change[0] - change[1];
  const Eigen::MatrixXd error = leaf.residuals(missing, Eigen::all) - change[1];
  const Eigen::VectorXd weights = leaf.weights(missing);
  const double squares = weights.dot(apart.cwiseAbs2() * data_.output_weights);
  const double product = weights.dot(apart.cwiseProduct(error) * data_.output_weights);
  const double prior = prior_rows * squares / weights.sum();
  return squares > 0.0 ? std::clamp((product + prior * known) / (squares + prior), 0.0, 1.0) : known;
}

// All orders stay sorted.
ExactLeaves::Children ExactLeaves::divide(const ExactLeaf& leaf, const Node& node, const SplitCandidate& split) const {
  const std::vector<Side> sides = sides_of(leaf, split);
  Children children;
  children.missing_left = split.by_missing ? 0.0 : learn_missing_left(leaf, node, sides);
  const std::array<double, 2> shares = {children.missing_left, 1.0 - children.missing_left};
  for (std::size_t side = 0; side < 2; ++side) {
    ExactLeaf& child = children.leaves[side];
    const Side own = side == 0 ? Side::left : Side::right;
    Rows position_in_child(sides.size(), -1);
    Rows positions;  // of the child's rows among the leaf's
    std::vector<double> weights;
    for (std::size_t k = 0; k < sides.size(); ++k) {
      const double share = sides[k] == own ? 1.0 : sides[k] == Side::both ? shares[side] : 0.0;
      // A row that may as well belong to the other side would teach the child wrong.
      if (share >= clear_share) {
        position_in_child[k] = static_cast<int>(positions.size());
        positions.push_back(static_cast<int>(k));
        weights.push_back(share * leaf.weights(k));
      }
    }
    child.weights = Eigen::Map<const Eigen::VectorXd>(weights.data(), std::ssize(weights));
    child.inputs = leaf.inputs(positions, Eigen::all);
    child.residuals = leaf.residuals(positions, Eigen::all);
    child.orders.resize(leaf.orders.size());
    for (std::size_t j = 0; j < leaf.orders.size(); ++j) {
      child.orders[j].reserve(positions.size());
      for (const int k : leaf.orders[j]) {
        if (const int position = position_in_child[k]; position >= 0) {
          child.orders[j].push_back(position);
        }
      }
    }
  }
  return children;
}

double ExactLeaves::threshold(const ExactLeaf& leaf, const SplitCandidate& split, const Node& node, const Node& left,
                              const Node& right) const {
  Rows order = leaf.orders[split.input];
  if (by_signs()) {
    // Those that go left first, as in a sorted order.
    const std::vector<Side> sides = sides_of(leaf, split);
    for (const Side side : {Side::left, Side::right}) {
      for (std::size_t k = 0; k < sides.size(); ++k) {
        if (sides[k] == side) {
          order.push_back(static_cast<int>(k));
        }
      }
    }
  }
  Eigen::VectorXd values(std::ssize(order));
  for (std::size_t k = 0; k < order.size(); ++k) {
    values(k) = split_value(leaf, order[k], split.input);
  }
  // The regression of the child models' difference on the split input over the node's rows says how far apart they are,
  // on average, on the plane x_j = t: a + b (t - mean).
  const Eigen::VectorXd weights = leaf.weights(order);
  RowMajor x = deviations(leaf)(order, Eigen::all);
  if (data_.training.has_missing) {
    x = x.array().isNaN().select(node.mean.transpose().replicate(x.rows(), 1), x).eval();
  }
  const Eigen::MatrixXd apart = (x * (right.slope - left.slope).transpose()).rowwise() +
                                Eigen::RowVectorXd((right.value - left.value).transpose());
  const double mean = weights.dot(values) / weights.sum();
  const Eigen::VectorXd centred = values.array() - mean;
  const Eigen::VectorXd weighted = centred.cwiseProduct(weights);
  const Eigen::VectorXd b = apart.transpose() * weighted / weighted.dot(centred);
  const Eigen::VectorXd a = apart.transpose() * weights / weights.sum();
  const Eigen::Index right_rows = values.size() - split.left;
  return data_.place_threshold(values.head(split.left).maxCoeff(), values.tail(right_rows).minCoeff(), mean, a, b);
}

}  // namespace llmt
