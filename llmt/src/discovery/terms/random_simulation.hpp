/// \file
/// A simulation whose outputs are random cannot be searched: its noise would be taken for what its parameters change.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace llmt::discovery {

/// Throws RandomSimulation if two runs at the same inputs and values differ by more than rounding, a billionth of the
/// largest magnitude of the output. `first`, `second`: n x d.
void refuse_random(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                   const std::vector<std::string>& outputs);

}  // namespace llmt::discovery
