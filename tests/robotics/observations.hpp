// Measurements of several targets, sessions, orientations and distances, as the tests make them.
#pragma once

#include <string>
#include <vector>

#include "llmt/random.hpp"
#include "robotics/robots.hpp"

namespace llmt::robotics {

/// Every pose seen once with each of the observations.
inline Poses looked_at(const Poses& poses, const std::vector<Observation>& views) {
  std::vector<Eigen::Index> rows;
  std::vector<Observation> observations;
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    for (Observation view : views) {
      view.stand = i;
      rows.push_back(i);
      observations.push_back(view);
    }
  }
  Poses seen = select(poses, rows);
  seen.observations = std::move(observations);
  return seen;
}

/// The rows of one after those of the other; the second's stands are counted on.
inline Measurements joined(const Measurements& first, const Measurements& second) {
  Measurements both = first;
  const Eigen::Index n = first.count();
  both.poses.joints.conservativeResize(n + second.count(), Eigen::NoChange);
  both.poses.joints.bottomRows(second.count()) = second.poses.joints;
  both.positions_mm.conservativeResize(n + second.count(), Eigen::NoChange);
  both.positions_mm.bottomRows(second.count()) = second.positions_mm;
  for (Observation seen : second.poses.observations) {
    seen.stand += n;
    both.poses.observations.push_back(seen);
  }
  return both;
}

/// What the robot shows, with noise.
inline Measurements read_off(const Robot& truth, const Poses& poses, double noise_mm, std::uint64_t seed) {
  Measurements measurements;
  measurements.poses = poses;
  measurements.positions_mm = positions(truth, poses);
  Random random(seed);
  for (Eigen::Index i = 0; i < poses.count(); ++i) {
    const bool is_distance = !poses.observations.empty() && poses.observations[i].reading == Reading::distance;
    if (is_distance) measurements.measured = {true, false, false};
    for (Eigen::Index axis = 0; axis < (is_distance ? 1 : 3); ++axis) {
      measurements.positions_mm(i, axis) += noise_mm * random.normal();
    }
  }
  return measurements;
}

}  // namespace llmt::robotics
