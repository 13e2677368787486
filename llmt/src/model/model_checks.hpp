/// \file
/// Whether the parts of a model fit together.
#pragma once

#include <vector>

#include "llmt/model.hpp"

namespace llmt {

/// Throws std::invalid_argument "llmt::Model: ..." that names the first part that does not fit: see Model::Model().
void check_model(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs,
                 const std::vector<Regressor>& regressors, const std::vector<Partition>& partitions);

}  // namespace llmt
