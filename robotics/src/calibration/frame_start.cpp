#include "calibration/frame_start.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <span>

#include "calibration/registration.hpp"
#include "llmt/robotics/calibration_problem.hpp"
#include "robot/settings.hpp"

namespace llmt::robotics {
namespace {

constexpr std::size_t coordinates_of_frame = 6;

bool is_free(const std::vector<std::string>& reasons, std::size_t first, std::size_t count) {
  return std::ranges::all_of(std::span(reasons).subspan(first, count),
                             [](const std::string& why) { return why.empty(); });
}

// About `count` rows at equal steps: enough to compare starts.
Measurements rows_at_steps(const Measurements& measurements, Eigen::Index count) {
  std::vector<Eigen::Index> rows;
  const Eigen::Index step = std::max<Eigen::Index>(1, measurements.count() / count);
  for (Eigen::Index i = 0; i < measurements.count(); i += step) rows.push_back(i);
  return select(measurements, rows);
}

// Gives a robot the base that its tool and the readings tell in closed form. A radius that is found stands in the
// readings afterwards.
using PlaceBase = Robot (*)(Robot robot, Measurements& measurements);

Robot by_points(Robot robot, Measurements& measurements) {
  return with_closed_form_base(std::move(robot), measurements);
}

Robot by_plane(Robot robot, Measurements& measurements) { return with_base_on_plane(std::move(robot), measurements); }

Robot by_distances(Robot robot, Measurements& measurements) {
  return with_base_by_distances(std::move(robot), measurements);
}

// The radius is that of the mean distance from the centre.
Robot by_sphere(Robot robot, Measurements& measurements) {
  robot = with_base_by_distances(std::move(robot), measurements);
  measurements.positions_mm.col(0).setConstant(positions(robot, measurements.poses).col(0).mean());
  return robot;
}

// The guess of the tool matters: with a wrong one, Kabsch's base lies in the basin of another minimum.
Robot best_start(const Robot& robot, const Measurements& measurements, const std::vector<std::string>& reasons,
                 const discovery::SolverOptions& solver, PlaceBase place) {
  Measurements few = rows_at_steps(measurements, 200);
  Eigen::Matrix3Xd guesses = Eigen::Matrix3Xd::Zero(3, 7);
  constexpr double tool_guess_mm = 150.0;
  for (int axis = 0; axis < 3; ++axis) {
    guesses(axis, 1 + axis) = tool_guess_mm;
    guesses(axis, 4 + axis) = -tool_guess_mm;
  }
  const bool tool_is_free = is_free(reasons, coordinates_of_frame, 3);
  Robot best = robot;
  double smallest = std::numeric_limits<double>::infinity();
  for (Eigen::Index guess = 0; guess < (tool_is_free ? guesses.cols() : 1); ++guess) {
    Robot start = robot;
    start.chain.tool.xyz_mm += guesses.col(guess);
    start = place(std::move(start), few);
    Robot trial = start;
    const discovery::SolverResult result = fit_frames(trial, few, reasons, solver);
    // The tool as given comes first and is kept unless another guess is better by more than 0.1 %.
    if (result.residual_norms.back() < 0.999 * smallest) {
      smallest = result.residual_norms.back();
      best = trial;
    }
  }
  return best;
}

Measurements of_reading(const Measurements& measurements, Reading reading) {
  const std::vector<Observation>& observations = measurements.poses.observations;
  if (observations.empty()) return measurements;
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (observations[i].reading == reading) rows.push_back(static_cast<Eigen::Index>(i));
  }
  return select(measurements, rows);
}

Frame& frame_of(Frame& own, std::vector<NamedFrame>& further, const std::string& name) {
  if (name.empty()) return own;
  return std::ranges::find(further, name, &NamedFrame::name)->frame;
}

double& radius_of(Chain& chain, const std::string& base) {
  return std::ranges::find(chain.bases, base, &NamedFrame::name)->radius_mm;
}

// The frames of a setting that touches a plane or a sphere.
Robot started_by_touch(const Robot& robot, const Measurements& measurements, const std::string& base,
                       const std::vector<std::string>& reasons, const discovery::SolverOptions& solver) {
  const bool is_flat = is_plane(base);
  if (!is_free(reasons, 0, is_flat ? coordinates_of_frame : 3)) return robot;  // a sphere has no angles
  return best_start(robot, measurements, reasons, solver,
                    is_flat           ? by_plane
                    : is_sphere(base) ? by_sphere
                                      : by_distances);
}

// The frames of one setting. Those of its base that an earlier setting began with are known, its tool is not.
Robot started(Robot robot, const Measurements& measurements, bool base_is_known,
              const std::vector<std::string>& reasons, const discovery::SolverOptions& solver) {
  const Measurements points = of_reading(measurements, Reading::position);
  const bool all_seen = std::ranges::all_of(measurements.measured, [](bool seen) { return seen; });
  const bool base_is_free = is_free(reasons, 0, coordinates_of_frame) && !base_is_known;
  if (points.count() > 0 && all_seen) {
    if (base_is_free) {
      robot = best_start(robot, points, reasons, solver, by_points);
    } else if (base_is_known && is_free(reasons, coordinates_of_frame, 3)) {
      robot = with_closed_form_tool(std::move(robot), points);
    }
  }
  if (measurements.poses.observations.empty()) return robot;
  const Measurements distances = of_reading(measurements, Reading::distance);
  if (distances.count() > 0 && base_is_free && points.count() == 0)
    robot = with_base_by_distances(std::move(robot), distances);
  const Measurements turns = of_reading(measurements, Reading::orientation);
  if (turns.count() > 0 && is_free(reasons, coordinates_of_frame + 3, 3)) {
    robot = with_closed_form_orientation(std::move(robot), turns);
  }
  return robot;
}

}  // namespace

discovery::SolverResult solve_for(Robot& robot, discovery::LeastSquaresProblem problem,
                                  const std::vector<std::string>& reasons, const discovery::SolverOptions& solver) {
  for (std::size_t k = 0; k < reasons.size(); ++k) problem.parameters[k].free = reasons[k].empty();
  discovery::SolverResult result = discovery::solve(problem, solver);
  robot = with_values(std::move(robot), result.values);
  return result;
}

discovery::Jacobian free_derivatives(const Robot& robot, const Measurements& measurements,
                                     const std::vector<std::string>& reasons, bool of_rigid_arm) {
  std::vector<Eigen::Index> free;
  for (std::size_t k = 0; k < reasons.size(); ++k) {
    if (reasons[k].empty()) free.push_back(static_cast<Eigen::Index>(k));
  }
  return [=, poses = measurements.poses, rows = measured_rows(measurements)](const Eigen::VectorXd& values) {
    Robot moved = with_values(robot, values);
    if (of_rigid_arm) moved.effects.clear();
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(std::ssize(rows), values.size());
    jacobian(Eigen::all, free) = position_jacobian(moved, poses, free)(rows, Eigen::all);
    return jacobian;
  };
}

discovery::SolverResult fit_frames(Robot& robot, const Measurements& measurements,
                                   const std::vector<std::string>& reasons, const discovery::SolverOptions& solver) {
  discovery::LeastSquaresProblem problem = calibration_problem(robot, measurements);
  problem.jacobian = free_derivatives(robot, measurements, reasons, true);
  return solve_for(robot, problem, reasons, solver);
}

Robot with_started_frames(Robot robot, const Measurements& measurements, const std::vector<std::string>& reasons,
                          const discovery::SolverOptions& solver) {
  const Frame given_tool = robot.chain.tool;
  std::set<std::string> known_bases;
  for (const Setting& setting : settings_of(robot, measurements.poses)) {
    Measurements own = select(measurements, setting.rows);
    own.poses = setting.poses;
    std::vector<std::string> own_reasons;
    for (const Eigen::Index column : columns_of(setting, robot)) own_reasons.push_back(reasons[column]);
    const bool is_plain = measurements.poses.observations.empty();
    const Observation seen = is_plain ? Observation{} : measurements.poses.observations[setting.rows.front()];
    Robot part = setting.robot;
    part.chain.base = frame_of(robot.chain.base, robot.chain.bases, seen.base);
    // A tool that nothing is known of is most likely where the first one is.
    const bool is_copy = part.chain.tool.xyz_mm == given_tool.xyz_mm && part.chain.tool.rpy_deg == given_tool.rpy_deg;
    if (is_copy) part.chain.tool = robot.chain.tool;
    const bool is_known = known_bases.contains(seen.base);
    const bool by_touch = is_touched(seen.base) && !is_socket(seen.base);
    if (by_touch && !is_known) {
      part = started_by_touch(part, own, seen.base, own_reasons, solver);
    } else if (!by_touch) {
      part = started(std::move(part), own, is_known, own_reasons, solver);
    }
    frame_of(robot.chain.base, robot.chain.bases, seen.base) = part.chain.base;
    if (is_sphere(seen.base) && setting.radius >= 0 && !is_known && reasons[setting.radius].empty()) {
      radius_of(robot.chain, seen.base) = positions(part, own.poses).col(0).mean();
    }
    frame_of(robot.chain.tool, robot.chain.tools, seen.tool) = part.chain.tool;
    known_bases.insert(seen.base);
  }
  return robot;
}

}  // namespace llmt::robotics
