#include "llmt/discovery/rounds.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace llmt::discovery {
namespace {

bool agree(const RoundSummary& one, const RoundSummary& other, std::size_t negligible_outliers) {
  std::vector<std::size_t> differing;
  std::ranges::set_symmetric_difference(one.outliers, other.outliers, std::back_inserter(differing));
  return one.names == other.names && differing.size() <= negligible_outliers;
}

}  // namespace

bool until_settled(const RoundLimits& limits, RoundSummary start,
                   const std::function<std::optional<RoundSummary>(int)>& round) {
  RoundSummary last = std::move(start);
  std::set<RoundSummary> earlier;
  for (int k = 0; k < limits.most; ++k) {
    std::optional<RoundSummary> now = round(k);
    if (!now) continue;
    if (now->may_be_last) {
      if (agree(*now, last, limits.negligible_outliers)) return true;
      if (!earlier.insert(*now).second && limits.stop_at_repeat) return false;
    }
    last = *std::move(now);
  }
  return false;
}

}  // namespace llmt::discovery
