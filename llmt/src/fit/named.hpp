/// \file
/// Models with the names of the data.
#pragma once

#include "llmt/model.hpp"
#include "llmt/training_data.hpp"

namespace llmt {

/// The model with the names that the data give. What they do not name keeps its name; names of categories that the
/// model does not have are left out.
Model named(const Model& model, const TrainingData& data);

}  // namespace llmt
