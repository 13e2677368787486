#include <optional>
#include <utility>

#include "base/checks.hpp"
#include "base/sizes_within.hpp"
#include "llmt/time_limit.hpp"

namespace llmt {

TimedSum fit_boosted_within(double seconds, const TrainingData& data, const BoostOptions& options,
                            const Progress& progress) {
  check_seconds("llmt::fit_boosted_within", seconds);
  constexpr Eigen::Index fewest_rounds = 32;
  const double begin = steady_seconds();
  std::optional<TimedSum> best;
  const auto fit_of_size = [&](Eigen::Index size, const Progress& told) {
    BoostOptions limited = options;
    limited.max_rounds = static_cast<int>(size);
    best = {fit_boosted(data, limited, told), limited, {}};
    best->time = {seconds, steady_seconds() - begin, size, size < options.max_rounds};
  };
  sizes_within(seconds, {.least = fewest_rounds, .most = options.max_rounds}, fit_of_size, progress);
  return *std::move(best);
}

}  // namespace llmt
