/// \file
/// Mistakes in the options of a fit that show without the data.
#pragma once

#include "llmt/options.hpp"

namespace llmt {

/// Throws std::invalid_argument naming option, value and bound. `inputs`: number of columns.
void check_options(const FitOptions& options, Eigen::Index inputs);

}  // namespace llmt
