#include "growth/hilomot/category_cut.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace llmt {
namespace {

// Number of orders of the levels of a categorical input that are tried, and of places where an order is cut.
constexpr std::size_t orders_of_levels = 3;
constexpr std::size_t most_level_cuts = 32;

// The level of each of a leaf's rows, -1 if it has none, and the weight of every level.
struct Levels {
  std::vector<int> of_row;
  Eigen::VectorXd weight;
};

Levels levels_of(const GateProblem& problem, const Eigen::VectorXd& values, int count) {
  Levels levels{std::vector<int>(values.size(), -1), Eigen::VectorXd::Zero(count)};
  for (std::size_t i = 0; i < levels.of_row.size(); ++i) {
    const double value = values(i);
    if (!std::isnan(value)) {
      levels.of_row[i] = static_cast<int>(value);
      levels.weight(levels.of_row[i]) += problem.weights(i);
    }
  }
  return levels;
}

// Rows without a level belong to both sides.
void cut_order(const GateProblem& problem, const Levels& levels, const std::vector<int>& order, LevelCut& best) {
  const std::size_t step = std::max<std::size_t>(1, order.size() / most_level_cuts);
  std::vector<int> side(levels.weight.size(), 0);
  for (const int level : order) {
    side[level] = 1;
  }
  const double known = levels.weight.sum();
  double on_left = 0.0;
  for (std::size_t k = 0; k + 1 < order.size(); ++k) {
    side[order[k]] = -1;
    on_left += levels.weight(order[k]);
    if ((k + 1) % step != 0) continue;
    Eigen::VectorXd share(std::ssize(levels.of_row));
    for (std::size_t i = 0; i < levels.of_row.size(); ++i) {
      const int level = levels.of_row[i];
      share(i) = level < 0 ? on_left / known : side[level] < 0 ? 1.0 : 0.0;
    }
    const double loss = share_loss(problem, share);
    ++best.evaluations;
    if (loss < best.loss) {
      best.loss = loss;
      best.side = side;
      best.left_share = on_left / known;
      best.share = std::move(share);
    }
  }
}

}  // namespace

LevelCut best_level_cut(const GateProblem& problem, const Eigen::VectorXd& values, int count) {
  const Levels levels = levels_of(problem, values, count);
  const Eigen::Index columns = problem.a.cols();
  const Eigen::VectorXd residual = problem.weights.cwiseProduct(problem.y * problem.output_weights.cwiseSqrt());
  Eigen::MatrixXd means = Eigen::MatrixXd::Zero(columns, levels.weight.size());
  for (Eigen::Index row = 0; row < std::ssize(levels.of_row); ++row) {
    if (levels.of_row[row] >= 0) {
      means.col(levels.of_row[row]) += residual(row) * problem.a.row(row).transpose();
    }
  }
  std::vector<int> present;
  for (int level = 0; level < levels.weight.size(); ++level) {
    if (levels.weight(level) > 0.0) {
      means.col(level) /= levels.weight(level);
      present.push_back(level);
    }
  }
  const Eigen::VectorXd spread = means.cwiseAbs2() * levels.weight;
  std::vector<Eigen::Index> keys(columns);
  std::iota(keys.begin(), keys.end(), Eigen::Index{0});
  std::ranges::stable_sort(keys, [&](auto a, auto b) { return spread(a) > spread(b); });
  keys.resize(std::min(keys.size(), orders_of_levels));
  LevelCut best;
  for (const Eigen::Index key : keys) {
    std::ranges::stable_sort(present, [&](int a, int b) { return means(key, a) < means(key, b); });
    cut_order(problem, levels, present, best);
  }
  return best;
}

}  // namespace llmt
