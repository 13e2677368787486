#include "report/robot/check_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "report/robot/input_checks.hpp"
#include "report/text/not_evaluated.hpp"

namespace llmt::report {

robotics::Robot for_any_session(robotics::Robot robot) {
  robotics::Chain& chain = robot.chain;
  std::erase_if(chain.tools, [&](const robotics::NamedFrame& tool) {
    return std::ranges::any_of(chain.bases, [&](const robotics::NamedFrame& base) {
      return tool.name == base.name || tool.name.starts_with(base.name + "/");
    });
  });
  chain.bases.clear();
  chain.session.clear();
  return robot;
}

robotics::RobotCheck run_check(const std::string& robot_file, const std::string& data,
                               const robotics::CorrectedRobot& robot, const robotics::Measurements& measurements,
                               const robotics::CheckOptions& options) {
  for (std::size_t row = 0; row < measurements.poses.observations.size() && !options.same_session; ++row) {
    const std::string& base = measurements.poses.observations[row].base;
    if (!robotics::is_touched(base)) continue;
    throw std::runtime_error(
        fmt::format("{}:{}: the place of {} is known only while the robot stays where it was; if it did, give "
                    "--same-session",
                    data, measurements.lines[row], base));
  }
  check_frames(data, robot.robot, measurements,
               options.same_session ? "" : "; check judges a file of one session and known targets");
  check_positions(robot_file, robot.robot, measurements.poses);
  robotics::RobotCheck check;
  try {
    check = robotics::check_robot(robot, measurements, options);
  } catch (const std::invalid_argument& error) {
    // What calibrations refuse of the number of poses or of the description is said with the names of the files.
    throw NotEvaluated(fmt::format("{}, {}: {}", robot_file, data, error.what()));
  }
  constexpr double implausible_share = 0.02;
  if (check.error.mean > implausible_share * robotics::size_of(robot.robot.chain, measurements)) {
    throw NotEvaluated(fmt::format(
        "{}: the robot misses the points by {:.0f} mm on average, base and tool {}: these are not measurements of it; "
        "check units, signs and order of the columns",
        data, check.error.mean, options.same_session ? "as calibrated" : "fitted to them"));
  }
  return check;
}

std::string check_refusal(const CheckFacts& facts) {
  if (facts.check.still_good) return "";
  return fmt::format("{}: the mean error is {:.4f} mm, more than {:.4f} mm", facts.data, facts.check.error.mean,
                     facts.check.limit_mm);
}

}  // namespace llmt::report
