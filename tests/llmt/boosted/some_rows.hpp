// Rows with inputs of many values and of few, and their bins.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "boosted/growing_tree.hpp"
#include "llmt/random.hpp"

namespace boosted_tests {

inline constexpr double missing = std::numeric_limits<double>::quiet_NaN();

struct Rows {
  llmt::BinnedRows binned;
  Eigen::MatrixXd z;
  Eigen::VectorXd y;
  std::vector<int> all;
};

inline Rows some_rows(Eigen::Index count, Eigen::Index features, bool weighted, double missing_share,
                      std::uint64_t seed) {
  llmt::Random random(seed);
  Rows rows;
  rows.z.resize(count, features);
  rows.y.resize(count);
  rows.binned.weights = Eigen::VectorXd::Ones(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < features; ++j) {
      rows.z(i, j) = static_cast<float>(j == 1 ? std::floor(random.uniform(0.0, 6.0)) : random.normal());
      if (random.uniform() < missing_share) rows.z(i, j) = missing;
    }
    rows.y(i) = random.normal() + (std::isnan(rows.z(i, 0)) ? 1.0 : std::abs(rows.z(i, 0)));
    if (weighted) rows.binned.weights(i) = 0.5 + random.uniform();
    rows.all.push_back(static_cast<int>(i));
  }
  rows.binned.equal_weights = !weighted;
  for (int j = 0; j < features; ++j) {
    rows.binned.features.push_back(llmt::bin_feature({.inputs = {j}}, rows.z.col(j), rows.binned.weights));
  }
  return rows;
}

}  // namespace boosted_tests
