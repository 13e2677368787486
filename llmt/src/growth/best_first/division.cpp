#include "growth/best_first/division.hpp"

#include <array>
#include <cmath>

#include "data/missing.hpp"
#include "growth/missing_left.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {
namespace {

// A split on a number: which side the value of a row lies on.
Side side_by_threshold(double value, double threshold) {
  if (std::isnan(value)) return Side::both;
  return value <= threshold ? Side::left : Side::right;
}

// Predictions at `queries` of a child's model minus those of the parent's, rows x outputs. A missing regressor counts
// as each model's own mean.
Eigen::MatrixXd change_of_prediction(const RowMajor& queries, const NodeFit& child, const Node& parent) {
  Eigen::MatrixXd change = child.centre_change.transpose().replicate(queries.rows(), 1);
  for (Eigen::Index i = 0; i < queries.rows(); ++i) {
    for (Eigen::Index k = 0; k < queries.cols(); ++k) {
      if (std::isnan(queries(i, k))) {
        change.row(i) +=
            (child.slope_change.col(k) * child.mean(k) + parent.slope.col(k) * (child.mean(k) - parent.mean(k)))
                .transpose();
      } else {
        change.row(i) += child.slope_change.col(k).transpose() * queries(i, k);
      }
    }
  }
  return change;
}

}  // namespace

std::vector<Side> sides_of(const GrowthData& data, const ExactLeaf& leaf, const SplitCandidate& split) {
  std::vector<Side> sides(leaf.inputs.rows(), Side::both);
  if (split.by_missing) {
    for (std::size_t k = 0; k < sides.size(); ++k) {
      sides[k] = std::isnan(leaf.split_value(data, k, split.input)) ? Side::right : Side::left;
    }
  } else if (data.num_levels[split.input] > 0) {
    const std::vector<int> levels = levels_in(data, leaf, split.input);
    for (std::size_t k = 0; k < sides.size(); ++k) {
      if (levels[k] >= 0) sides[k] = split.level_side[levels[k]] < 0 ? Side::left : Side::right;
    }
  } else if (data.problem.criterion == SplitCriterion::residual_signs) {
    for (std::size_t k = 0; k < sides.size(); ++k) {
      sides[k] = side_by_threshold(leaf.split_value(data, k, split.input), split.last_left);
    }
  } else {
    const std::vector<int>& order = leaf.orders[split.input];
    for (Eigen::Index k = 0; k < std::ssize(order); ++k) {
      sides[order[k]] = k < split.left ? Side::left : Side::right;
    }
  }
  return sides;
}

Eigen::MatrixXd about_own_mean(const RowMajor& deviations, const Node& parent, Eigen::MatrixXd residuals,
                               const Eigen::VectorXd& weights) {
  for (Eigen::Index k = 0; k < deviations.cols(); ++k) {
    const double mean = mean_of_present(deviations, k, weights);
    for (Eigen::Index i = 0; i < deviations.rows(); ++i) {
      if (std::isnan(deviations(i, k))) {
        residuals.row(i) += parent.slope.col(k).transpose() * (parent.mean(k) - mean);
      }
    }
  }
  return residuals;
}

double learn_missing_left(const GrowthData& data, const ExactLeaf& leaf, const Node& node,
                          const std::vector<Side>& sides) {
  std::array<std::vector<int>, 3> positions;  // of the rows on the left, on the right and without a value
  std::array<double, 3> weight{};
  for (int k = 0; k < std::ssize(sides); ++k) {
    const std::size_t side = static_cast<std::size_t>(sides[k]);
    positions[side].push_back(k);
    weight[side] += leaf.weights(k);
  }
  const double known = weight[0] / (weight[0] + weight[1]);
  const std::vector<int>& missing = positions[2];
  if (missing.empty()) return known;
  const RowMajor all = deviations_in(data, leaf);
  const RowMajor queries = all(missing, Eigen::all);
  std::array<Eigen::MatrixXd, 2> change;
  for (std::size_t side = 0; side < 2; ++side) {
    const RowMajor of_child = all(positions[side], Eigen::all);
    const Eigen::VectorXd weights = leaf.weights(positions[side]);
    const Eigen::MatrixXd residuals =
        about_own_mean(of_child, node, leaf.residuals(positions[side], Eigen::all), weights);
    change[side] = change_of_prediction(queries, fit_node(of_child, residuals, weights), node);
  }
  const Eigen::MatrixXd apart = change[0] - change[1];
  const Eigen::MatrixXd error = leaf.residuals(missing, Eigen::all) - change[1];
  const Eigen::VectorXd weights = leaf.weights(missing);
  return learned_missing_left({.squares = weights.dot(apart.cwiseAbs2() * data.output_weights),
                               .products = weights.dot(apart.cwiseProduct(error) * data.output_weights),
                               .rows = static_cast<double>(weights.size())},
                              known);
}

}  // namespace llmt
