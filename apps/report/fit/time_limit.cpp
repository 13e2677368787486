#include "report/fit/time_limit.hpp"

#include <fmt/format.h>

namespace llmt::report {

std::string time_limit_text(const TimeLimit& time, LimitedSize size) {
  const std::string limit = fmt::format("Time limit of {:g} s", time.seconds);
  const bool is_late = time.taken > time.seconds;
  if (!time.is_binding) {
    return fmt::format("{}: {}, the model is that of a fit without a limit", limit,
                       is_late ? fmt::format("too short, the fit took {:.2g} s", time.taken) : "not reached");
  }
  const bool is_tree = size == LimitedSize::leaves;
  const std::string most = fmt::format("{} {} at most", time.size, is_tree ? "leaves of a tree" : "rounds");
  const std::string again = fmt::format("the same model again: --max-{} {}", is_tree ? "leaves" : "rounds", time.size);
  if (!is_late) return fmt::format("{}: enough for {}; {}", limit, most, again);
  return fmt::format("{}: too short, the fit with {} took {:.2g} s; {}", limit, most, time.taken, again);
}

Json time_limit_json(const TimeLimit& time, LimitedSize size) {
  return {{"seconds", time.seconds},
          {"taken", time.taken},
          {"reached", time.is_binding},
          {size == LimitedSize::leaves ? "max_leaves" : "max_rounds", time.size}};
}

}  // namespace llmt::report
