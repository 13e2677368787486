// Tables, options and simulations that cannot be searched. Each of these throws and says why.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Throws std::invalid_argument for a simulation that cannot be run, for measured outputs that do not belong to the
/// inputs or are not finite, and for options out of range.
void refuse_wrong(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
                  const MissingOptions& options);

/// Throws RandomSimulation if two runs at the same inputs and values differ by more than rounding, a billionth of the
/// largest magnitude of the output. `first`, `second`: n x d.
void refuse_random(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                   const std::vector<std::string>& outputs);

/// Throws std::invalid_argument that names them where inputs determine a measured output, whatever the simulation says:
/// y = c + sum_j b_j x_j at every row, to the digits of a file, where the simulation is no such function of these
/// inputs. Measured values have noise, so an input like that is the output itself, or was computed with it.
void refuse_determined(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured);

}  // namespace llmt::discovery
