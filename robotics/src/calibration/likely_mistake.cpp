#include "calibration/likely_mistake.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <stdexcept>
#include <vector>

#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {
namespace {

constexpr double degrees = 180.0 / std::numbers::pi;

// A table as it may have been meant.
struct Change {
  std::function<void(Measurements&)> make;
  std::string words;
};

std::vector<Change> changes_of(const Chain& chain) {
  std::vector<Change> changes;
  const auto joints = std::ssize(chain.joints);
  const auto turn = [chain](double factor) {
    return [chain, factor](Measurements& table) {
      for (std::size_t j = 0; j < chain.joints.size(); ++j) {
        if (chain.joints[j].type == JointType::revolute) table.poses.joints.col(j) *= factor;
      }
    };
  };
  const auto stretch = [](double factor) { return [factor](Measurements& table) { table.positions_mm *= factor; }; };
  changes.push_back({turn(degrees), "the angles of the file are radians, not degrees"});
  changes.push_back({turn(1.0 / degrees), "the angles of the file are degrees, not radians"});
  changes.push_back({stretch(1000.0), "the measured positions are metres, not millimetres"});
  changes.push_back({stretch(0.001), "the measured positions are millimetres, not metres"});
  changes.push_back({[](Measurements& table) { table.positions_mm.col(0).swap(table.positions_mm.col(1)); },
                     "x and y of the measured points are exchanged, or an axis of the instrument is reversed"});
  for (Eigen::Index j = 0; j < joints; ++j) {
    const std::string& name = chain.joints[j].name;
    changes.push_back({[j](Measurements& table) { table.poses.joints.col(j) *= -1.0; },
                       fmt::format("{} counts in the other direction", name)});
    for (const double zero_deg : {90.0, -90.0, 180.0}) {
      if (chain.joints[j].type != JointType::revolute) continue;
      changes.push_back({[=](Measurements& table) { table.poses.joints.col(j).array() += zero_deg / degrees; },
                         fmt::format("{} has its zero {:g} deg away", name, zero_deg)});
    }
    for (Eigen::Index other = j + 1; other < joints; ++other) {
      changes.push_back({[=](Measurements& table) { table.poses.joints.col(j).swap(table.poses.joints.col(other)); },
                         fmt::format("the columns of {} and {} are exchanged", name, chain.joints[other].name)});
    }
  }
  for (const Eigen::Index by : {Eigen::Index{1}, joints - 1}) {
    changes.push_back({[=](Measurements& table) {
                         const Eigen::MatrixXd before = table.poses.joints;
                         for (Eigen::Index j = 0; j < joints; ++j)
                           table.poses.joints.col(j) = before.col((j + by) % joints);
                       },
                       "the columns of the joints are shifted by one"});
  }
  return changes;
}

// Every choice of two joints or more that count the other way, of an arm that a person may have described.
void add_sign_patterns(const Chain& chain, std::vector<Change>& changes) {
  constexpr std::size_t most_joints = 7;
  const std::size_t joints = chain.joints.size();
  for (unsigned pattern = 1; joints <= most_joints && pattern < (1U << joints); ++pattern) {
    if (std::popcount(pattern) < 2) continue;
    std::vector<std::string> names;
    for (std::size_t j = 0; j < joints; ++j) {
      if ((pattern >> j & 1U) != 0) names.push_back(chain.joints[j].name);
    }
    changes.push_back({[=](Measurements& table) {
                         for (std::size_t j = 0; j < joints; ++j) {
                           if ((pattern >> j & 1U) != 0) table.poses.joints.col(j) *= -1.0;
                         }
                       },
                       fmt::format("{} count in the other direction", fmt::join(names, ", "))});
  }
}

// As many poses as tell such mistakes.
Measurements some_of(const Measurements& measurements) {
  constexpr Eigen::Index enough = 25;
  std::vector<Eigen::Index> rows;
  const Eigen::Index step = std::max<Eigen::Index>(1, measurements.count() / enough);
  for (Eigen::Index row = 0; row < measurements.count(); row += step) rows.push_back(row);
  return select(measurements, rows);
}

double spread_of(const Eigen::MatrixXd& points) {
  return std::sqrt((points.rowwise() - points.colwise().mean()).rowwise().squaredNorm().mean());
}

double misfit_of(Robot robot, const Measurements& table) {
  try {
    // A table as it was meant takes some ten steps; any other may wander.
    CalibrationOptions options;
    options.solver.max_iterations = 15;
    register_frames(robot, table, options);
    return distances(positions(robot, table.poses), table).mean();
  } catch (const std::exception&) {
    return std::numeric_limits<double>::infinity();  // so it is not that
  }
}

}  // namespace

std::string likely_mistake(const Robot& robot, const Measurements& measurements, double misfit_mm,
                           double plausible_mm) {
  constexpr double far_better = 0.1;
  constexpr double of_spread = 0.05;
  const Measurements table = some_of(measurements);
  std::vector<Change> changes = changes_of(robot.chain);
  const std::size_t single = changes.size();
  add_sign_patterns(robot.chain, changes);
  const Change* best = nullptr;
  double smallest = std::min(far_better * misfit_mm, plausible_mm);
  for (std::size_t k = 0; k < changes.size() && (k < single || best == nullptr); ++k) {
    Measurements other = table;
    changes[k].make(other);
    const double misfit = misfit_of(robot, other);
    if (misfit >= smallest || misfit >= of_spread * spread_of(other.positions_mm)) continue;
    smallest = misfit;
    best = &changes[k];
  }
  if (best == nullptr) return {};
  return fmt::format("most likely {}: the described robot would then miss the points by {:.3g} mm instead of {:.3g} mm",
                     best->words, smallest, misfit_mm);
}

}  // namespace llmt::robotics
