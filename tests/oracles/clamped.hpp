// Models whose outputs are clamped, and data of a bounded target.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "llmt/model.hpp"
#include "llmt/random.hpp"
#include "oracles/oracles.hpp"

namespace oracle {

/// The model with each output clamped to its row of `range`, outputs x 2; no row: none is clamped.
inline llmt::Model clamped(const llmt::Model& model, const Eigen::MatrixXd& range) {
  std::vector<llmt::Partition> partitions = model.partitions();
  for (llmt::Partition& partition : partitions) {
    partition.output_range.resize(0, 0);
    if (range.rows() > 0) partition.output_range = range(partition.outputs, Eigen::all);
  }
  return {model.inputs(), model.outputs(), model.regressors(), std::move(partitions)};
}

inline llmt::Model unclamped(const llmt::Model& model) { return clamped(model, {}); }

/// Ten inputs of which seven count, and percentages: about 62 % of them are 0 and 20 % are 100, the others are a smooth
/// function that is cut off there, with noise before the cut.
struct Percentages {
  Eigen::MatrixXd x;
  Eigen::MatrixXd y;
};

inline Percentages percentages(Eigen::Index rows, std::uint64_t seed) {
  Percentages data{uniform(rows, 10, seed), Eigen::MatrixXd(rows, 1)};
  llmt::Random random(seed + 1000);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto x = data.x.row(i);
    const double latent = 2.0 * x(0) * x(1) + std::sin(3.0 * x(2)) + 1.5 * std::abs(x(3)) + x(4) +
                          (x(5) > 0.3 ? 0.8 : 0.0) + 0.5 * x(6) * x(6);
    data.y(i, 0) = std::clamp(140.0 * (latent - 1.6 + 0.05 * random.normal()), 0.0, 100.0);
  }
  return data;
}

}  // namespace oracle
