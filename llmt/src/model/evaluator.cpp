#include "model/evaluator.hpp"

#include <algorithm>

namespace llmt {

void Evaluator::local(int node, const double* deviations, double* values) const {
  std::fill(values, values + num_outputs(), 0.0);
  models_.add(node, 1.0, deviations, values);
}

void Evaluator::combine_unclamped(const std::vector<Activation>& active, const double* deviations,
                                  double* values) const {
  std::fill(values, values + num_outputs(), 0.0);
  for (const Activation& entry : active) {
    models_.add(entry.node, entry.validity, deviations, values);
  }
  models_.finish(deviations, values);
}

void Evaluator::combine(const std::vector<Activation>& active, const double* deviations, double* values) const {
  combine_unclamped(active, deviations, values);
  clamp(values);
}

// NaN stays NaN.
void Evaluator::clamp(double* values) const {
  for (Eigen::Index o = 0; o < output_range_.rows(); ++o) {
    values[o] = std::clamp(values[o], output_range_(o, 0), output_range_(o, 1));
  }
}

void Evaluator::predict(const RowBlock& block, std::vector<double>& values) const {
  values.assign(block.rows() * num_outputs(), 0.0);
  validities_.for_each_leaf(
      block, [&](int node, const RowList& list) { models_.add(node, list, block.deviations.data(), values.data()); });
  models_.finish_rows(block.rows(), block.deviations.data(), values.data());
  for (Eigen::Index row = 0; has_output_range() && row < block.rows(); ++row) {
    clamp(values.data() + row * num_outputs());
  }
}

}  // namespace llmt
