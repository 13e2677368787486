/// \file
/// From sums of squared held-out errors to RMSE and its spread over the folds.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numeric>
#include <vector>

#include "llmt/statistics.hpp"
#include "selection/candidates.hpp"

namespace llmt {

inline double sum_of(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

/// Makes CandidateError from the sums of weighted squared errors of the folds.
class FoldErrors {
 public:
  FoldErrors(const std::vector<FoldRows>& folds, Eigen::Index outputs) {
    for (const FoldRows& fold : folds) {
      weights_.push_back(total_weight(fold.held_out) * static_cast<double>(outputs));
    }
  }

  CandidateError operator()(const Candidate& candidate, const std::vector<double>& errors) const {
    CandidateError result{candidate, std::sqrt(sum_of(errors) / sum_of(weights_)), 0.0};
    result.fold_rmse.resize(std::ssize(errors));
    for (std::size_t f = 0; f < errors.size(); ++f) {
      result.fold_rmse(f) = std::sqrt(errors[f] / weights_[f]);
    }
    result.spread = spread_of(result.fold_rmse);
    return result;
  }

 private:
  std::vector<double> weights_;
};

}  // namespace llmt
