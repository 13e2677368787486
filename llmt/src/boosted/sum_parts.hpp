/// \file
/// A sum of trees put together from rounds of boosting.
#pragma once

#include <vector>

#include "boosted/boosting.hpp"

namespace llmt {

/// Rounds that are a part of a sum, with the trees whose residuals they started from.
struct SumPart {
  double share = 1.0;
  double rate = 1.0;
  Rounds rounds;
  std::vector<BoostedTree> start = {};
};

/// mean + scale . sum of share . (base + start + rate . trees), the shares adding up to 1. Its rate is the first
/// part's; the leaves of the other trees are multiplied by what theirs differs.
BoostedSum sum_of(const std::vector<SumPart>& members, const BinnedRows& rows, double mean, double scale);

}  // namespace llmt
