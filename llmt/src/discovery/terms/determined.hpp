/// \file
/// Outputs that are among the inputs in disguise.
#pragma once

#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Throws std::invalid_argument that names them where inputs determine a measured output, whatever the simulation says:
/// y = c + sum_j b_j x_j at every row, to the digits of a file, where the simulation is no such function of these
/// inputs. Measured values have noise, so an input like that is the output itself, or was computed with it.
void refuse_determined(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured);

}  // namespace llmt::discovery
