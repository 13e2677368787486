/// \file
/// Checks of the parts of a boosted model, and its arithmetic for one row.
#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/boosted_sum.hpp"
#include "llmt/partition.hpp"

namespace llmt {

/// What is wrong with a part. what(): "llmt::BoostedModel: sums/0/trees/3: problem".
class BoostedFault : public std::invalid_argument {
 public:
  BoostedFault(const std::string& pointer, const std::string& problem)
      : std::invalid_argument("llmt::BoostedModel: " + (pointer.empty() ? "" : pointer.substr(1) + ": ") + problem),
        pointer_(pointer),
        problem_(problem) {}

  const std::string& pointer() const { return pointer_; }  ///< in the JSON of the model, "/sums/0/trees/3"
  const std::string& problem() const { return problem_; }

 private:
  std::string pointer_;
  std::string problem_;
};

/// Throws BoostedFault for the first part that does not fit: see BoostedModel::BoostedModel().
void check_boosted(const std::vector<InputColumn>& inputs, const std::vector<OutputColumn>& outputs,
                   const std::vector<double>& deviations, const std::vector<BoostedSum>& sums);

/// The value of a feature at the row `x`; NaN: missing, which a level that is not known is too.
double feature_at(const BoostedFeature& feature, std::span<const InputColumn> inputs,
                  std::span<const double> deviations, const double* x);

/// The value of a tree where the features are `z`.
double value_of(const BoostedTree& tree, const double* z);

}  // namespace llmt
