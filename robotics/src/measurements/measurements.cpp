#include "llmt/robotics/measurements.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace llmt::robotics {

Measurements select(const Measurements& measurements, const std::vector<Eigen::Index>& rows) {
  Measurements chosen;
  chosen.poses = select(measurements.poses, rows);
  chosen.positions_mm = measurements.positions_mm(rows, Eigen::all);
  chosen.measured = measurements.measured;
  chosen.session = measurements.session;
  chosen.target = measurements.target;
  chosen.orientation.kind = measurements.orientation.kind;
  chosen.orientation.convention = measurements.orientation.convention;
  if (measurements.orientation.values.size() != 0) {
    chosen.orientation.values = measurements.orientation.values(rows, Eigen::all);
  }
  for (std::size_t k = 0; k < rows.size() && !measurements.lines.empty(); ++k) {
    chosen.lines.push_back(measurements.lines[rows[k]]);
  }
  return chosen;
}

Measurements without_rows(const Measurements& measurements, const std::vector<std::size_t>& left_out) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    if (std::ranges::find(left_out, static_cast<std::size_t>(i)) == left_out.end()) rows.push_back(i);
  }
  return select(measurements, rows);
}

void validate(const Measurements& measurements, const Robot& robot) {
  const auto refuse = [](const std::string& message) {
    throw std::invalid_argument("llmt::robotics::Measurements: " + message);
  };
  const Poses& poses = measurements.poses;
  const Eigen::Index joints = std::ssize(robot.chain.joints);
  if (poses.joints.cols() != joints) {
    refuse(fmt::format("there are {} joints, robot \"{}\" has {}", poses.joints.cols(), robot.chain.name, joints));
  }
  if (poses.count() == 0) refuse("there are no rows");
  if (measurements.positions_mm.rows() != poses.count() || measurements.positions_mm.cols() != 3) {
    refuse(fmt::format("positions_mm is {} x {}, must be {} x 3", measurements.positions_mm.rows(),
                       measurements.positions_mm.cols(), poses.count()));
  }
  if (std::ranges::none_of(measurements.measured, [](bool seen) { return seen; })) refuse("no coordinate was measured");
  if (!poses.observations.empty() && std::ssize(poses.observations) != poses.count()) {
    refuse(fmt::format("there are {} observations of {} rows", poses.observations.size(), poses.count()));
  }
  if (!poses.joints.allFinite()) refuse("a joint value is not finite");
  if (!measurements.positions_mm.allFinite()) refuse("a position is not finite");
  for (const auto& [name, values] : poses.covariates) {
    if (values.size() != poses.count())
      refuse(fmt::format("column {} has {} values, must be {}", name, values.size(), poses.count()));
    if (!values.allFinite()) refuse(fmt::format("column {} has a value that is not finite", name));
    if (name == "payload_kg" && values.minCoeff() < 0.0) {
      refuse(fmt::format("column payload_kg has {}, must not be negative", values.minCoeff()));
    }
  }
}

void add_moves(Poses& poses, const Chain& chain) {
  auto column = poses.covariates.find("order");
  if (column == poses.covariates.end()) column = poses.covariates.find("time_s");
  if (column == poses.covariates.end()) return;
  std::vector<Eigen::Index> sequence(poses.count());
  std::iota(sequence.begin(), sequence.end(), Eigen::Index{0});
  std::ranges::stable_sort(sequence, {}, [&](Eigen::Index row) { return column->second(row); });
  Eigen::MatrixXd moves = Eigen::MatrixXd::Zero(poses.count(), poses.joints.cols());
  for (std::size_t k = 1; k < sequence.size(); ++k) {
    moves.row(sequence[k]) = poses.joints.row(sequence[k]) - poses.joints.row(sequence[k - 1]);
  }
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    const char* unit = chain.joints[j].type == JointType::revolute ? "rad" : "mm";
    poses.covariates[fmt::format("move{}_{}", j + 1, unit)] = moves.col(j);
  }
}

bool is_move(std::string_view column) { return column.starts_with("move"); }

std::vector<Eigen::Index> measured_rows(const Measurements& measurements) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < measurements.count(); ++i) {
    const std::vector<Observation>& seen = measurements.poses.observations;
    const Eigen::Index axes = !seen.empty() && seen[i].reading == Reading::distance ? 1 : 3;
    for (Eigen::Index axis = 0; axis < axes; ++axis) {
      if (measurements.measured[axis]) rows.push_back(3 * i + axis);
    }
  }
  return rows;
}

Eigen::VectorXd distances(const Eigen::MatrixXd& model_mm, const Measurements& measurements) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(measurements.count());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (!measurements.measured[axis]) continue;
    squares += (model_mm.col(axis) - measurements.positions_mm.col(axis)).cwiseAbs2();
  }
  return squares.cwiseSqrt();
}

}  // namespace llmt::robotics
