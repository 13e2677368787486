/// \file
/// Variants of the trees, compared on held-out rows after a few rounds.
#pragma once

#include <string>
#include <vector>

#include "boosted/boosting.hpp"
#include "boosted/boosting_data.hpp"

namespace llmt {

/// How a sum is boosted.
struct SumPlan {
  RoundOptions rounds;
  std::string name;                         ///< of the variant
  BinnedRows rows;                          ///< with pairs and directions, if these were better
  std::vector<BoostVariant> compared = {};  ///< for the standardised output; empty: there was no race
};

/// The winner among symmetric trees with the options `usual` and their variants, see "The race" in
/// docs/algorithms/boosting.md: free trees (not where all parts are raced), constants in place of linear models, pairs
/// of features, soft trees, directions. `output`: standardised.
SumPlan race(const BoostingData& data, const Eigen::VectorXd& output, const RoundOptions& usual, std::uint64_t seed,
             Work& work);

}  // namespace llmt
