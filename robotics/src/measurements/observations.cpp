#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>

#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/orientation.hpp"

namespace llmt::robotics {
namespace {

std::vector<Eigen::Index> rows_where(const Poses& poses, bool is_orientation) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const bool is = !poses.observations.empty() && poses.observations[i].reading == Reading::orientation;
    if (is == is_orientation) rows.push_back(i);
  }
  return rows;
}

void add_missing(std::vector<NamedFrame>& frames, const std::string& name, const Frame& frame) {
  if (name.empty() || std::ranges::find(frames, name, &NamedFrame::name) != frames.end()) return;
  frames.push_back({name, frame});
}

// The column in mm, or null.
std::optional<Eigen::VectorXd> in_mm(const Poses& poses, const std::string& name) {
  for (const auto& [unit, factor] : {std::pair{"um", 1e-3}, std::pair{"mm", 1.0}}) {
    const auto found = poses.covariates.find(fmt::format("{}_{}", name, unit));
    if (found != poses.covariates.end()) return factor * found->second;
  }
  return std::nullopt;
}

}  // namespace

std::vector<Eigen::Index> orientation_rows(const Poses& poses) { return rows_where(poses, true); }

std::vector<Eigen::Index> position_rows(const Poses& poses) { return rows_where(poses, false); }

Measurements with_orientations(const Measurements& measurements, const Chain& chain) {
  const auto refuse = [](const char* message) {
    throw std::invalid_argument(fmt::format("llmt::robotics::with_orientations: {}", message));
  };
  if (measurements.orientation.values.rows() == 0) refuse("no orientation was measured");
  if (std::ranges::any_of(measurements.measured, [](bool seen) { return !seen; })) {
    refuse("positions need all of x, y and z where orientations are fitted, too");
  }
  const Eigen::Index n = measurements.count();
  const std::vector<Eigen::Matrix3d> rotations = rotations_of(
      measurements.orientation,
      measurements.orientation.convention.empty() ? chain.orientation : measurements.orientation.convention);
  std::vector<Eigen::Index> twice;
  for (int part = 0; part < 2; ++part) {
    for (Eigen::Index row = 0; row < n; ++row) twice.push_back(row);
  }
  Measurements both = select(measurements, twice);
  both.positions_mm.bottomRows(n).setZero();
  std::vector<Observation>& observations = both.poses.observations;
  if (observations.empty()) {
    observations.resize(2 * n);
    for (Eigen::Index row = 0; row < 2 * n; ++row) observations[row].stand = row % n;
  }
  std::vector<Eigen::Index> kept;
  for (Eigen::Index row = 0; row < n; ++row) kept.push_back(row);
  for (Eigen::Index row = 0; row < n; ++row) {
    if (observations[row].reading != Reading::position) refuse("only positions can have orientations");
    if (is_socket(observations[row].base)) refuse("a reading of a socket has no orientation");
    observations[n + row].reading = Reading::orientation;
    observations[n + row].reference = rotations[row];
    // Several targets of a pose share one orientation: it is one reading.
    const bool is_same = row > 0 && observations[row].stand == observations[row - 1].stand &&
                         observations[row].base == observations[row - 1].base && rotations[row] == rotations[row - 1];
    if (!is_same) kept.push_back(n + row);
  }
  both = select(both, kept);
  both.warnings = measurements.warnings;
  both.unused_columns = measurements.unused_columns;
  return both;
}

Robot with_frames(Robot robot, const Measurements& measurements) {
  if (robot.chain.session.empty()) robot.chain.session = measurements.session;
  if (robot.chain.target.empty()) robot.chain.target = measurements.target;
  return with_frames(std::move(robot), measurements.poses);
}

Robot with_frames(Robot robot, const Poses& poses) {
  for (const Observation& seen : poses.observations) {
    add_missing(robot.chain.bases, seen.base, robot.chain.base);
    add_missing(robot.chain.tools, seen.tool, robot.chain.tool);
  }
  return robot;
}

std::vector<double> sweeps_of(const Poses& poses) {
  constexpr double standing = 1e-3;  // of the joint's range
  constexpr double most_steps = 0.5;
  constexpr double fewest_sweeps = 5.0;
  const Eigen::MatrixXd& joints = poses.joints;
  const Eigen::Index n = joints.rows();
  if (n < 2) return {};
  const Eigen::RowVectorXd least = standing * (joints.colwise().maxCoeff() - joints.colwise().minCoeff());
  std::vector<double> labels(n, 0.0);
  double sweep = 0.0;
  double in_sweeps = 0.0;
  double steps = 0.0;
  Eigen::Index swept = -1;  // the joint of this sweep
  for (Eigen::Index i = 1; i < n; ++i) {
    const Eigen::ArrayXd by = (joints.row(i) - joints.row(i - 1)).cwiseAbs().transpose();
    const auto moves = by > least.transpose().array();
    const Eigen::Index moving = moves.count();
    if (moving > 0) steps += 1.0;
    Eigen::Index joint = swept;
    if (moving == 1) by.maxCoeff(&joint);
    for (Eigen::Index j = 0; j < by.size() && moving == 1; ++j) joint = moves(j) ? j : joint;
    const bool goes_on = moving == 0 || (moving == 1 && (swept < 0 || joint == swept));
    if (moving == 1) in_sweeps += 1.0;
    if (!goes_on) sweep += 1.0;
    swept = moving == 0 ? swept : moving == 1 ? joint : -1;
    labels[i] = sweep;
  }
  const bool are_sweeps = in_sweeps >= most_steps * steps && steps > 0.0 && sweep + 1.0 >= fewest_sweeps;
  return are_sweeps ? labels : std::vector<double>{};
}

std::vector<double> path_of(const Poses& poses) {
  constexpr Eigen::Index fewest = 50;  // poses
  constexpr double near = 0.1;
  constexpr double stretches = 25.0;
  const Eigen::Index n = poses.joints.rows();
  if (n < fewest) return {};
  Eigen::RowVectorXd spread = ((poses.joints.rowwise() - poses.joints.colwise().mean()).colwise().norm()).eval();
  spread = (spread.array() > 0.0).select(spread, 1.0);
  const Eigen::MatrixXd scaled = poses.joints.array().rowwise() / spread.array();
  std::vector<double> steps;
  std::vector<double> others;
  for (Eigen::Index i = 1; i < n; ++i) {
    constexpr Eigen::Index factor = 7;  // pairs of any distance in the order
    const double step = (scaled.row(i) - scaled.row(i - 1)).norm();
    if (step > 0.0) steps.push_back(step);
    others.push_back((scaled.row(i) - scaled.row((factor * i + n / 3) % n)).norm());
  }
  const auto middle = [](std::vector<double>& values) {
    std::ranges::nth_element(values, values.begin() + std::ssize(values) / 2);
    return values[values.size() / 2];
  };
  if (steps.empty() || !(middle(steps) <= near * middle(others))) return {};
  std::vector<double> labels(n);
  for (Eigen::Index i = 0; i < n; ++i)
    labels[i] = std::floor(stretches * static_cast<double>(i) / static_cast<double>(n));
  // Repeats of a pose, and readings of a stand, stay together.
  for (Eigen::Index i = 1; i < n; ++i) {
    if (poses.joints.row(i) == poses.joints.row(i - 1)) labels[i] = labels[i - 1];
  }
  return labels;
}

std::vector<double> pose_labels(const Poses& poses) {
  std::vector<double> stretches = sweeps_of(poses);
  if (stretches.empty()) stretches = path_of(poses);
  if (!stretches.empty()) {
    std::map<Eigen::Index, double> of_stand;  // its readings may stand far apart in the table
    for (std::size_t i = 0; i < poses.observations.size(); ++i) {
      stretches[i] = of_stand.try_emplace(poses.observations[i].stand, stretches[i]).first->second;
    }
    return stretches;
  }
  const auto pose = poses.covariates.find("pose");
  if (pose != poses.covariates.end()) return {pose->second.begin(), pose->second.end()};
  std::vector<double> labels;
  for (const Observation& seen : poses.observations) labels.push_back(static_cast<double>(seen.stand));
  return labels;
}

Eigen::RowVector3d mean_reading(const Measurements& measurements, const std::vector<Eigen::Index>& rows) {
  if (orientation_rows(measurements.poses).empty()) return measurements.positions_mm(rows, Eigen::all).colwise().mean();
  const Observation& first = measurements.poses.observations[rows.front()];
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  for (const Eigen::Index row : rows) {
    sum += measurements.positions_mm.row(row);
    if (first.reading != Reading::orientation) continue;
    const Observation& seen = measurements.poses.observations[row];
    const Eigen::AngleAxisd turn(seen.reference * first.reference.transpose());
    sum += first.lever_mm * turn.angle() * turn.axis().transpose();
  }
  return sum / static_cast<double>(rows.size());
}

Eigen::MatrixXd stated_sigma_mm(const Measurements& measurements) {
  Eigen::MatrixXd sigma = Eigen::MatrixXd::Zero(measurements.count(), 3);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const auto& [name, factor] : {std::pair{"U95", 0.5}, std::pair{"sigma", 1.0}}) {
      for (const std::string& column : {std::string(name), fmt::format("{}_{}", name, "xyz"[axis])}) {
        if (const auto values = in_mm(measurements.poses, column)) sigma.col(axis) = factor * *values;
      }
    }
  }
  for (const Eigen::Index row : orientation_rows(measurements.poses)) sigma.row(row).setZero();
  return sigma;
}

}  // namespace llmt::robotics
