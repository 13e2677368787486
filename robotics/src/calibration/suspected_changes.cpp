#include "calibration/suspected_changes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>
#include <set>
#include <utility>

#include "calibration/travel.hpp"
#include "kinematics/units.hpp"
#include "llmt/robotics/calibration.hpp"

namespace llmt::robotics {
namespace {

const auto as_it_stands = [](Measurements&) {};

// A factor on some angles of the description.
auto described_turn(std::vector<double Joint::*> angles, double factor) {
  return [angles = std::move(angles), factor](Chain& meant) {
    for (Joint& joint : meant.joints) {
      for (double Joint::*angle : angles) joint.*angle *= factor;
    }
  };
}

// Units of all angles.
void add_angles(const Chain& chain, std::vector<Change>& changes) {
  const auto turn = [chain](double factor) {
    return [chain, factor](Measurements& table) {
      for (std::size_t j = 0; j < chain.joints.size(); ++j) {
        if (chain.joints[j].type == JointType::revolute) table.poses.joints.col(j) *= factor;
      }
    };
  };
  changes.push_back({"angles_radians", "the angles of the table are radians, not degrees (end their columns with _rad)",
                     turn(degrees)});
  changes.push_back({"angles_degrees", "the angles of the table are degrees, not radians (end their columns with _deg)",
                     turn(1.0 / degrees)});
  const struct {
    const char* name;
    const char* words;
    std::vector<double Joint::*> angles;
  } described[] = {{"description", "the angles", {&Joint::alpha_deg, &Joint::theta_deg, &Joint::beta_deg}},
                   {"alpha", "the angles alpha", {&Joint::alpha_deg}},
                   {"theta", "the angles theta", {&Joint::theta_deg}}};
  for (const auto& own : described) {
    changes.push_back({fmt::format("{}_radians", own.name),
                       fmt::format("{} of the description are radians, not degrees", own.words), as_it_stands,
                       described_turn(own.angles, degrees)});
    changes.push_back({fmt::format("{}_degrees", own.name),
                       fmt::format("{} of the description are degrees, not radians", own.words), as_it_stands,
                       described_turn(own.angles, 1.0 / degrees)});
  }
}

// Units of all lengths. What is a thousand times too small or too large is the description where no arm is of its size,
// else the table.
void add_lengths(const Chain& chain, const Poses& poses, std::vector<Change>& changes) {
  const auto stretch = [](double factor) { return [factor](Measurements& table) { table.positions_mm *= factor; }; };
  const auto described_stretch = [](double factor, bool with_tool) {
    return [factor, with_tool](Chain& meant) {
      for (Joint& joint : meant.joints) {
        for (double* length : {&joint.a_mm, &joint.d_mm, &joint.b_mm}) *length *= factor;
      }
      if (with_tool) meant.tool.xyz_mm *= factor;
    };
  };
  constexpr double shortest_mm = 20.0;
  constexpr double longest_mm = 1e5;
  constexpr double mm_of_an_inch = 25.4;
  const double length_mm = reach_of(chain) - chain.tool.xyz_mm.norm() + travel_of(chain, poses);
  for (const bool with_tool : {true, false}) {
    if (length_mm < shortest_mm) {
      changes.push_back({"description_metres", "the lengths of the description are metres, not millimetres",
                         as_it_stands, described_stretch(1000.0, with_tool)});
    } else if (length_mm > longest_mm) {
      changes.push_back({"description_millimetres", "the lengths of the description are millimetres, not metres",
                         as_it_stands, described_stretch(0.001, with_tool)});
    }
    changes.push_back({"description_inches", "the lengths of the description are inches", as_it_stands,
                       described_stretch(mm_of_an_inch, with_tool)});
  }
  if (length_mm >= shortest_mm) {
    changes.push_back({"positions_millimetres",
                       "the measured positions are millimetres, not metres (end their columns with _mm)",
                       stretch(0.001)});
  }
  if (length_mm <= longest_mm) {
    changes.push_back({"positions_metres",
                       "the measured positions are metres, not millimetres (end their columns with _m)",
                       stretch(1000.0)});
  }
  changes.push_back({"positions_inches", "the measured positions are inches", stretch(mm_of_an_inch)});
}

// One of several targets may be in another unit than the rest.
void add_units_of_targets(const Poses& poses, std::vector<Change>& changes) {
  std::set<std::string> tools;
  for (const Observation& seen : poses.observations) tools.insert(seen.tool);
  if (tools.size() < 2) return;
  for (const std::string& tool : tools) {
    for (const auto& [factor, unit, words] :
         {std::tuple{1000.0, "metres", "metres, not millimetres"}, {0.001, "millimetres", "millimetres, not metres"}}) {
      const std::string target = tool.empty() ? "the first target" : "target \"" + tool + "\"";
      changes.push_back({fmt::format("target_{}_{}", tool.empty() ? "1" : tool, unit),
                         fmt::format("the points of {} are {}", target, words),
                         [tool, factor = factor](Measurements& table) {
                           for (Eigen::Index row = 0; row < table.count(); ++row) {
                             if (table.poses.observations[row].tool == tool) table.positions_mm.row(row) *= factor;
                           }
                         }});
    }
  }
}

// Of one joint: direction, unit, zero.
void add_joint(const Joint& joint, Eigen::Index j, std::vector<Change>& changes) {
  const std::string& name = joint.name;
  changes.push_back({name + "_sign", fmt::format("{} counts in the other direction", name),
                     [j](Measurements& table) { table.poses.joints.col(j) *= -1.0; }});
  if (joint.type != JointType::revolute) return;
  for (const auto& [factor, unit, words] :
       {std::tuple{degrees, "radians", "radians, not degrees"}, {1.0 / degrees, "degrees", "degrees, not radians"}}) {
    changes.push_back({fmt::format("{}_{}", name, unit), fmt::format("the values of {} are {}", name, words),
                       [j, factor = factor](Measurements& table) { table.poses.joints.col(j) *= factor; }});
  }
  for (const double zero_deg : {90.0, -90.0, 180.0}) {
    changes.push_back({fmt::format("{}_zero_{:g}", name, zero_deg),
                       fmt::format("{} has its zero {:g} deg away", name, zero_deg),
                       [=](Measurements& table) { table.poses.joints.col(j).array() += zero_deg / degrees; }});
  }
}

// Columns that belong to other joints, and a joint that counts from where the one before it points, as J3 of many arms
// counts from the horizon.
void add_orders(const Chain& chain, std::vector<Change>& changes) {
  const auto joints = std::ssize(chain.joints);
  const auto name = [&](Eigen::Index j) -> const std::string& { return chain.joints[j].name; };
  for (Eigen::Index j = 0; j < joints; ++j) {
    for (Eigen::Index other = j + 1; other < joints; ++other) {
      changes.push_back({fmt::format("{}_{}_exchanged", name(j), name(other)),
                         fmt::format("the columns of {} and {} are exchanged", name(j), name(other)),
                         [=](Measurements& table) { table.poses.joints.col(j).swap(table.poses.joints.col(other)); }});
    }
    if (j + 1 == joints) continue;
    for (const double sign : {1.0, -1.0}) {
      changes.push_back(
          {fmt::format("{}_counted_with_{}", name(j + 1), name(j)),
           fmt::format("{0} is counted from the horizon, not from the link before it: its angle is {0} {1} {2}",
                       name(j + 1), sign > 0.0 ? "+" : "-", name(j)),
           [=](Measurements& table) { table.poses.joints.col(j + 1) += sign * table.poses.joints.col(j); }});
    }
  }
  changes.push_back({"joints_reversed", "the columns of the joints are in reversed order",
                     [](Measurements& table) { table.poses.joints = table.poses.joints.rowwise().reverse().eval(); }});
  for (const Eigen::Index by : {Eigen::Index{1}, joints - 1}) {
    changes.push_back({"joints_shifted", "the columns of the joints are shifted by one", [=](Measurements& table) {
                         const Eigen::MatrixXd before = table.poses.joints;
                         for (Eigen::Index j = 0; j < joints; ++j)
                           table.poses.joints.col(j) = before.col((j + by) % joints);
                       }});
  }
}

// Numbers of one convention under the name of the other: alpha and a stand before the joint, not behind it, or the
// other way round. With the numbers as they are, and moved by a joint.
void add_convention(const Chain& chain, std::vector<Change>& changes) {
  const bool is_dh = chain.convention == Convention::dh;
  const std::string words =
      fmt::format("the description has the convention {}, not {}", is_dh ? "mdh" : "dh", is_dh ? "dh" : "mdh");
  changes.push_back({is_dh ? "mdh" : "dh", words, as_it_stands,
                     [is_dh](Chain& meant) { meant.convention = is_dh ? Convention::mdh : Convention::dh; }});
}

}  // namespace

std::vector<Change> single_changes(const Chain& chain, const Poses& poses) {
  std::vector<Change> changes;
  add_angles(chain, changes);
  add_lengths(chain, poses, changes);
  changes.push_back({"axes", "x and y of the measured points are exchanged, or an axis of the instrument is reversed",
                     [](Measurements& table) { table.positions_mm.col(0).swap(table.positions_mm.col(1)); }});
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    add_joint(chain.joints[j], static_cast<Eigen::Index>(j), changes);
  }
  add_orders(chain, changes);
  add_convention(chain, changes);
  add_units_of_targets(poses, changes);
  return changes;
}

std::vector<Change> sign_patterns(const Chain& chain) {
  constexpr std::size_t most_joints = 7;
  std::vector<Change> changes;
  const std::size_t joints = chain.joints.size();
  for (unsigned pattern = 1; joints <= most_joints && pattern < (1U << joints); ++pattern) {
    if (std::popcount(pattern) < 2) continue;
    std::vector<std::string> names;
    for (std::size_t j = 0; j < joints; ++j) {
      if ((pattern >> j & 1U) != 0) names.push_back(chain.joints[j].name);
    }
    changes.push_back({fmt::format("{}_signs", fmt::join(names, "_")),
                       fmt::format("{} count in the other direction", fmt::join(names, ", ")),
                       [=](Measurements& table) {
                         for (std::size_t j = 0; j < joints; ++j) {
                           if ((pattern >> j & 1U) != 0) table.poses.joints.col(j) *= -1.0;
                         }
                       }});
  }
  return changes;
}

}  // namespace llmt::robotics
