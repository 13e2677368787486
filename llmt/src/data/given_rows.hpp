/// \file
/// What a caller tells of rows and columns, as a fit takes it.
#pragma once

#include "data/training.hpp"
#include "llmt/training_data.hpp"

namespace llmt {

/// The rows of the data. The result views the matrices. Throws std::invalid_argument as fit() for names that do not fit
/// the columns, and for what is no category.
GivenRows given_rows(const TrainingData& data);

}  // namespace llmt
