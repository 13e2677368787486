#include "llmt/robotics/robot_types.hpp"

#include <algorithm>

namespace llmt::robotics {

Poses select(const Poses& poses, const std::vector<Eigen::Index>& rows) {
  Poses chosen{.joints = poses.joints(rows, Eigen::all), .covariates = {}};
  for (const auto& [name, values] : poses.covariates) chosen.covariates[name] = values(rows);
  if (poses.observations.empty()) return chosen;
  for (const Eigen::Index row : rows) chosen.observations.push_back(poses.observations[row]);
  return chosen;
}

bool has_instrument(const Poses& poses) {
  const auto& seen = poses.observations;
  return seen.empty() || !std::ranges::all_of(seen, is_touched, &Observation::base);
}

}  // namespace llmt::robotics
