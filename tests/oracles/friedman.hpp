// Rows of Friedman's function (1991) with noise.
#pragma once

#include <cmath>
#include <cstdint>

#include "llmt/random.hpp"
#include "llmt/training_data.hpp"

namespace oracle {

/// Friedman's function of five inputs, an input of noise, noise of deviation 1.
inline llmt::TrainingData friedman(Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  llmt::TrainingData data;
  data.inputs.resize(rows, 6);
  data.outputs.resize(rows, 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < 6; ++j) data.inputs(i, j) = random.uniform();
    const auto x = data.inputs.row(i);
    data.outputs(i, 0) = 10.0 * std::sin(3.14159265 * x(0) * x(1)) + 20.0 * (x(2) - 0.5) * (x(2) - 0.5) + 10.0 * x(3) +
                         5.0 * x(4) + random.normal();
  }
  return data;
}

}  // namespace oracle
