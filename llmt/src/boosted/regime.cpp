#include "boosted/regime.hpp"

#include <algorithm>
#include <cmath>

namespace llmt {

Regime regime_of(Eigen::Index rows, Eigen::Index inputs) {
  const auto next = std::ranges::upper_bound(regimes, rows, {}, &Regime::rows);
  Regime regime = next == regimes.begin() ? regimes.front() : *std::prev(next);
  if (inputs > regime.most_inputs_of_tree) regime.rules_of_tree = {};
  return regime;
}

int depth_of(Eigen::Index rows) {
  constexpr double train_share = 0.8;
  constexpr double rows_of_leaf = 16.0;
  return static_cast<int>(
      std::clamp(std::floor(std::log2(train_share * static_cast<double>(rows) / rows_of_leaf)), 1.0, 6.0));
}

Eigen::Index num_parts_of(const Regime& regime, Eigen::Index rows) {
  return regime.held_out > 0 ? rows / regime.held_out : 5;
}

Eigen::Index raced_rows(Eigen::Index rows) { return std::clamp<Eigen::Index>(rows / 4, 10000, 100000); }

bool is_worth_refitting(Eigen::Index held_out, Eigen::Index rows) { return 20 * held_out > rows; }

}  // namespace llmt
