#include "report/fit/time_limit.hpp"

#include <fmt/format.h>

namespace llmt::report {

std::string time_limit_text(const TimeLimit& time, LimitedSize size) {
  if (!time.is_binding) {
    return fmt::format("Time limit of {:g} s: not reached, the model is that of a fit without a limit", time.seconds);
  }
  const bool is_tree = size == LimitedSize::leaves;
  const std::string again = fmt::format("the same model again: --max-{} {}", is_tree ? "leaves" : "rounds", time.size);
  const std::string unit = is_tree ? "leaves of a tree at most" : "rounds at most";
  if (time.taken > time.seconds) {
    return fmt::format("Time limit of {:g} s: too short, the smallest fit took {:.2g} s, with {} {}; {}", time.seconds,
                       time.taken, time.size, unit, again);
  }
  return fmt::format("Time limit of {:g} s: enough for {} {}; {}", time.seconds, time.size, unit, again);
}

Json time_limit_json(const TimeLimit& time, LimitedSize size) {
  return {{"seconds", time.seconds},
          {"taken", time.taken},
          {"reached", time.is_binding},
          {size == LimitedSize::leaves ? "max_leaves" : "max_rounds", time.size}};
}

}  // namespace llmt::report
