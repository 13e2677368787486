/// \file
/// The held-out error of a sum from all rows, where a single set of held-out rows chose it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "boosted/average.hpp"
#include "boosted/boosting_data.hpp"
#include "boosted/race.hpp"

namespace llmt {

/// What the rows of the part 0 chose.
struct ChosenSum {
  const SumPlan& plan;
  Eigen::Index rounds = 0;              ///< number of trees
  Eigen::Vector2d shares = {1.0, 0.0};  ///< of the sum and of one tree beside it
  std::optional<FitOptions> tree = {};  ///< of this tree, with nothing left to choose; none: its share is 0
};

/// A residual for each row, 0 for those of part 0: those of any other part are of the same sum, fitted without the
/// part. The errors of these rows chose nothing; part 0 chose among sums that had learned from them. None where a sum
/// cannot say the tree of some part. `output`: standardised.
std::optional<Eigen::VectorXd> residuals_of_other_parts(const BoostingData& data, const Eigen::VectorXd& output,
                                                        const ChosenSum& chosen, std::uint64_t seed, Work& work);

}  // namespace llmt
