/// \file
/// Rows of a fit from arrays.
#pragma once

#include <optional>

#include "llmt/training_data.hpp"
#include "python/bindings/arrays.hpp"

namespace llmt::python {

/// The rows with their weights and groups; what is known of columns is left to the caller.
inline TrainingData training_data_of(const Array& inputs, const Array& outputs, const std::optional<Vector>& weights,
                                     const std::optional<Vector>& groups) {
  TrainingData data{.inputs = rows_of(inputs), .outputs = rows_of(outputs)};
  if (weights) data.weights = vector_of(*weights);
  if (groups) {
    const Eigen::VectorXd labels = vector_of(*groups);
    data.groups.assign(labels.begin(), labels.end());
  }
  return data;
}

}  // namespace llmt::python
