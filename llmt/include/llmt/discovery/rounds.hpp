/// \file
/// Rounds of search and refit until two in a row agree.
///
///     using llmt::discovery::RoundSummary;
///     const auto search_and_refit = [](int round) -> std::optional<RoundSummary> {
///       return RoundSummary{.names = {round > 0 ? "drag" : "friction"}, .outliers = {}};
///     };
///     const bool has_settled = llmt::discovery::until_settled({.most = 4}, {}, search_and_refit);
#pragma once

#include <compare>
#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <string>

namespace llmt::discovery {

/// The result of a round as far as rounds are compared.
struct RoundSummary {
  std::multiset<std::string> names;  ///< one for each candidate that was found
  std::set<std::size_t> outliers;    ///< samples that the refit left out
  bool may_be_last = true;           ///< false: the next round has other candidates
  auto operator<=>(const RoundSummary&) const = default;
};

struct RoundLimits {
  int most = 4;                         ///< rounds
  std::size_t negligible_outliers = 0;  ///< in which two rounds may differ and still agree
  bool stop_at_repeat = false;  ///< stop where a round says what an earlier one said: it would go on in a circle
};

/// Calls `round` with 0, 1, ... until its summary agrees with that of the round before: the same names and nearly the
/// same outliers. The first one is compared with `start`. A round that returns no summary is not compared with any.
/// Returns whether the last two rounds agree.
bool until_settled(const RoundLimits& limits, RoundSummary start,
                   const std::function<std::optional<RoundSummary>(int)>& round);

}  // namespace llmt::discovery
