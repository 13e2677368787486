#include "calibration/input_mistakes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

#include "calibration/registration.hpp"
#include "kinematics/rotations.hpp"
#include "kinematics/units.hpp"
#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {
namespace {

// Description and table as they may have been meant.
struct Change {
  std::function<void(Measurements&)> make;
  std::string words;
  std::function<void(Chain&)> describe = {};  // empty: the description is right
};

const auto as_it_stands = [](Measurements&) {};

// Units of all angles, of all lengths. What is a thousand times too small or too large is the description where no arm
// is of its size, else the table.
void add_units(const Chain& chain, std::vector<Change>& changes) {
  const auto turn = [chain](double factor) {
    return [chain, factor](Measurements& table) {
      for (std::size_t j = 0; j < chain.joints.size(); ++j) {
        if (chain.joints[j].type == JointType::revolute) table.poses.joints.col(j) *= factor;
      }
    };
  };
  const auto stretch = [](double factor) { return [factor](Measurements& table) { table.positions_mm *= factor; }; };
  const auto described_turn = [](double factor) {
    return [factor](Chain& meant) {
      for (Joint& joint : meant.joints) {
        for (double* angle : {&joint.alpha_deg, &joint.theta_deg, &joint.beta_deg}) *angle *= factor;
      }
    };
  };
  const auto described_stretch = [](double factor, bool with_tool) {
    return [factor, with_tool](Chain& meant) {
      for (Joint& joint : meant.joints) {
        for (double* length : {&joint.a_mm, &joint.d_mm, &joint.b_mm}) *length *= factor;
      }
      if (with_tool) meant.tool.xyz_mm *= factor;
    };
  };
  changes.push_back({turn(degrees), "the angles of the table are radians, not degrees (end their columns with _rad)"});
  changes.push_back(
      {turn(1.0 / degrees), "the angles of the table are degrees, not radians (end their columns with _deg)"});
  changes.push_back({as_it_stands, "the angles of the description are radians, not degrees", described_turn(degrees)});
  changes.push_back(
      {as_it_stands, "the angles of the description are degrees, not radians", described_turn(1.0 / degrees)});
  constexpr double shortest_mm = 20.0;
  constexpr double longest_mm = 1e5;
  const double length_mm = length_of(chain);
  for (const bool with_tool : {true, false}) {
    if (length_mm < shortest_mm) {
      changes.push_back({as_it_stands, "the lengths of the description are metres, not millimetres",
                         described_stretch(1000.0, with_tool)});
    } else if (length_mm > longest_mm) {
      changes.push_back({as_it_stands, "the lengths of the description are millimetres, not metres",
                         described_stretch(0.001, with_tool)});
    }
  }
  if (length_mm >= shortest_mm) {
    changes.push_back(
        {stretch(0.001), "the measured positions are millimetres, not metres (end their columns with _mm)"});
  }
  if (length_mm <= longest_mm) {
    changes.push_back(
        {stretch(1000.0), "the measured positions are metres, not millimetres (end their columns with _m)"});
  }
}

std::vector<Change> changes_of(const Chain& chain) {
  std::vector<Change> changes;
  const auto joints = std::ssize(chain.joints);
  add_units(chain, changes);
  changes.push_back({[](Measurements& table) { table.positions_mm.col(0).swap(table.positions_mm.col(1)); },
                     "x and y of the measured points are exchanged, or an axis of the instrument is reversed"});
  for (Eigen::Index j = 0; j < joints; ++j) {
    const std::string& name = chain.joints[j].name;
    changes.push_back({[j](Measurements& table) { table.poses.joints.col(j) *= -1.0; },
                       fmt::format("{} counts in the other direction", name)});
    const bool turns = chain.joints[j].type == JointType::revolute;
    for (const auto& [factor, words] :
         {std::pair{degrees, "radians, not degrees"}, {1.0 / degrees, "degrees, not radians"}}) {
      if (!turns) continue;
      changes.push_back({[j, factor = factor](Measurements& table) { table.poses.joints.col(j) *= factor; },
                         fmt::format("the values of {} are {}", name, words)});
    }
    for (const double zero_deg : {90.0, -90.0, 180.0}) {
      if (!turns) continue;
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

// One of several targets may be in another unit than the rest.
void add_units_of_targets(const Poses& poses, std::vector<Change>& changes) {
  std::set<std::string> tools;
  for (const Observation& seen : poses.observations) tools.insert(seen.tool);
  if (tools.size() < 2) return;
  for (const std::string& tool : tools) {
    for (const auto& [factor, words] :
         {std::pair{1000.0, "metres, not millimetres"}, {0.001, "millimetres, not metres"}}) {
      changes.push_back({[tool, factor = factor](Measurements& table) {
                           for (Eigen::Index row = 0; row < table.count(); ++row) {
                             if (table.poses.observations[row].tool == tool) table.positions_mm.row(row) *= factor;
                           }
                         },
                         fmt::format("the points of {} are {}",
                                     tool.empty() ? "the first target" : "target \"" + tool + "\"", words)});
    }
  }
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

// Points or distances of as many poses as tell such mistakes, at equal steps.
Measurements some_of(const Measurements& measurements) {
  constexpr std::size_t enough = 25;
  std::map<Eigen::Index, std::vector<Eigen::Index>> stands;
  for (const Eigen::Index row : position_rows(measurements.poses)) {
    stands[measurements.poses.observations.empty() ? row : measurements.poses.observations[row].stand].push_back(row);
  }
  const std::size_t step = std::max<std::size_t>(1, stands.size() / enough);
  std::vector<Eigen::Index> rows;
  std::size_t place = 0;
  for (const auto& [stand, own] : stands) {
    if (place++ % step == 0) rows.insert(rows.end(), own.begin(), own.end());
  }
  std::ranges::sort(rows);
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
    robot = with_frames(std::move(robot), table.poses);
    register_frames(robot, table, options);
    return distances(positions(robot, table.poses), table).mean();
  } catch (const std::exception&) {
    return std::numeric_limits<double>::infinity();  // so it is not that
  }
}

}  // namespace

// Without the tool, which may have been fitted to anything.
double length_of(const Chain& chain) { return reach_of(chain) - chain.tool.xyz_mm.norm(); }

std::string input_mistake(const Robot& robot, const Measurements& measurements, double plausible_share) {
  constexpr double far_better = 0.1;
  constexpr double of_spread = 0.05;
  constexpr double as_good = 1.05;
  const Measurements table = some_of(measurements);
  const double misfit_mm = misfit_of(robot, table);
  std::vector<Change> changes = changes_of(robot.chain);
  add_units_of_targets(table.poses, changes);
  const std::size_t single = changes.size();
  add_sign_patterns(robot.chain, changes);
  struct Explanation {
    double share;  // of the spread of the points: units are compared by how well they fit, not by how small they are
    double misfit_mm;
    std::string words;
  };
  std::vector<Explanation> found;
  const double largest = std::min(far_better * misfit_mm / spread_of(table.positions_mm), of_spread);
  for (std::size_t k = 0; k < changes.size() && (k < single || found.empty()); ++k) {
    Measurements meant = table;
    changes[k].make(meant);
    Robot arm = robot;
    if (changes[k].describe) changes[k].describe(arm.chain);
    const double misfit = misfit_of(arm, meant);
    const double share = misfit / spread_of(meant.positions_mm);
    if (share < largest && misfit < plausible_share * length_of(arm.chain)) {
      found.push_back({share, misfit, changes[k].words});
    }
  }
  if (found.empty()) return {};
  const Explanation best = *std::ranges::min_element(found, {}, &Explanation::share);
  std::vector<std::string> words;  // a wrist that counts the other way is one whose zero is half a turn away
  for (const Explanation& one : found) {
    if (one.share <= as_good * best.share && std::ranges::find(words, one.words) == words.end())
      words.push_back(one.words);
  }
  return fmt::format("most likely {}: the described robot would then miss the points by {:.3g} mm instead of {:.3g} mm",
                     fmt::join(words, ", or "), best.misfit_mm, misfit_mm);
}

std::string orientation_mistake(const Robot& robot, const Measurements& measurements) {
  constexpr double plausible_rad = 0.05;
  const std::vector<Eigen::Index> turned = orientation_rows(measurements.poses);
  Robot placed = robot;
  try {
    register_frames(placed, select(measurements, position_rows(measurements.poses)));
  } catch (const std::exception&) {
    return {};
  }
  const std::vector<Pose> tools = tool_poses(placed, select(measurements.poses, turned));
  const auto mean_angle = [&](const auto& meant) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    std::vector<Eigen::Matrix3d> between;
    for (std::size_t k = 0; k < turned.size(); ++k) {
      between.push_back(tools[k].rotation.transpose() * meant(measurements.poses.observations[turned[k]].reference));
      sum += between.back();
    }
    const Eigen::Matrix3d common = rotation_of_greatest_trace(sum.transpose());
    double angles = 0.0;
    for (const Eigen::Matrix3d& one : between) angles += Eigen::AngleAxisd(common.transpose() * one).angle();
    return angles / static_cast<double>(between.size());
  };
  const auto inverse = [](const Eigen::Matrix3d& read) -> Eigen::Matrix3d { return read.transpose(); };
  if (mean_angle(inverse) < plausible_rad) return "the file has the rotation of the world as seen from the tool";
  // The numbers that were read as w, x, y, z are x, y, z, w.
  const auto reordered = [](const Eigen::Matrix3d& read) -> Eigen::Matrix3d {
    const Eigen::Quaterniond q(read);
    return Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
  };
  if (measurements.orientation.kind == Orientation::Kind::quaternion && mean_angle(reordered) < plausible_rad) {
    return "the columns qw, qx, qy, qz hold x, y, z, w";
  }
  return {};
}

}  // namespace llmt::robotics
