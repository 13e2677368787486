/// \file
/// A discovery from what was read to what is reported.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "llmt/robotics/discovery/discovery.hpp"
#include "report/robot/discovery/next_poses.hpp"
#include "report/robot/input_checks.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// What is asked of a discovery. The name of the robot's file stands in messages.
struct DiscoveryTask {
  std::string robot_file;
  int folds = 0;  ///< of a cross-validation of the whole discovery; 0: none
  bool contiguous = false;
  robotics::DiscoveryOptions options = {};
  std::string accept_suspicion = {};  ///< name of a suspicion that is none
  Face face = {};
};

/// The whole discovery repeated without each fold and judged on it: mean errors, mm.
struct DiscoveryFolds {
  int folds = 0;
  bool contiguous = false;
  double before_mm = 0.0;
  double after_mm = 0.0;
};

/// A discovery with all that its reports show.
struct DiscoveryRun {
  robotics::Robot robot;  ///< as described, with frames for all that was measured
  robotics::Measurements measurements;
  robotics::Discovery found;
  bool has_test = false;
  std::optional<DiscoveryFolds> folds;
  std::vector<NextPoses> next;
};

/// Columns that the catalogue's effects, a user's own among them, look at: to be read as covariates.
std::vector<std::string> searched_columns(const std::vector<robotics::EffectType>& catalogue,
                                          const robotics::Robot& robot);

/// Discovers what the described robot lacks. `read_test` gives measurements that take no part until the end; it may be
/// empty. `warn` gets what looks wrong with the measurements: wrong units, signs or zeros are easily taken for effects.
/// Throws as robotics::discover() and check_positions().
DiscoveryRun run_discovery(const robotics::Robot& described, const robotics::Measurements& measured,
                           const std::function<robotics::Measurements(const robotics::Robot&)>& read_test,
                           DiscoveryTask task, const Warn& warn);

/// Of each measured point whether it was set aside; empty where the points judged are those of a test.
std::vector<bool> are_set_aside(const DiscoveryRun& run);

/// For people. `data`: the name of the table of measurements.
std::string discovery_text(const DiscoveryRun& run, const std::string& data, std::size_t width = no_width_limit,
                           const Face& face = {});

/// discovery_json() with the cross-validation.
Json discovery_run_json(const DiscoveryRun& run);

}  // namespace llmt::report
