#include "mechanism/assembler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace llmt::robotics {

Assembler::Assembler(const Mechanism& mechanism, const Eigen::VectorXd& sigma)
    : equations_(mechanism), parameters_(values_of(mechanism)), sigma_(sigma) {
  const SolvedPose home = nearest_configuration(equations_, parameters_, start_of(mechanism));
  if (!home.ok()) {
    throw std::invalid_argument("llmt::robotics::Mechanism: no configuration near the start values: " + home.failure);
  }
  home_ = home.coordinates;
  solved_ = {home_};
  turning_ = turning_coordinates(mechanism);
}

void Assembler::remember(const Eigen::VectorXd& configuration) {
  constexpr std::size_t most = 200;
  solved_.insert(solved_.begin() + 1, configuration);
  if (solved_.size() > most) solved_.pop_back();
}

// The same configuration, its angles turned as close to the known ones as whole turns allow.
Eigen::VectorXd Assembler::turned_to(Eigen::VectorXd configuration, const Eigen::VectorXd& known) const {
  for (const Eigen::Index i : turning_) {
    if (std::isfinite(known(i))) configuration(i) += whole_turns(known(i) - configuration(i));
  }
  return configuration;
}

// The solved configurations whose coordinates are nearest in what is known, the nearest first.
std::vector<Eigen::VectorXd> Assembler::nearest(const Eigen::VectorXd& known, std::size_t count) const {
  std::vector<std::pair<double, std::size_t>> distances;
  for (std::size_t k = 0; k < solved_.size(); ++k) {
    const Eigen::ArrayXd gap = (known - turned_to(solved_[k], known)).array() / equations_.typical().array();
    distances.emplace_back(gap.isNaN().select(0.0, gap).square().sum(), k);
  }
  count = std::min(count, distances.size());
  std::ranges::partial_sort(distances, distances.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<Eigen::VectorXd> found;
  for (std::size_t k = 0; k < count; ++k) found.push_back(solved_[distances[k].second]);
  return found;
}

// By the short way round, or the long way if the short one is blocked.
SolvedPose Assembler::reached(const Eigen::VectorXd& from, const Eigen::VectorXd& known) {
  const Eigen::VectorXd turned = turned_to(from, known);
  SolvedPose pose = follow(equations_, parameters_, turned, known, sigma_);
  if (pose.ok() || turned == from) return pose;
  SolvedPose around = follow(equations_, parameters_, from, known, sigma_);
  return around.ok() ? around : pose;
}

std::string Assembler::why_not(const PoseKinds& kinds) const {
  const Eigen::Index unknown = std::ssize(kinds.unknown);
  const Eigen::Index equations = equations_.count();
  if (unknown > equations) {
    return fmt::format("{} coordinates are not measured, {} equations cannot tell them", unknown, equations);
  }
  if (equations > unknown + std::ssize(kinds.noisy)) {
    return fmt::format(
        "{} equations are beyond what is not measured, and {} readings have noise: state the sigma of "
        "more",
        equations - unknown, kinds.noisy.size());
  }
  return "";
}

SolvedPose Assembler::pose(const Eigen::VectorXd& known, const Eigen::VectorXd& before) {
  constexpr std::size_t most_neighbours = 6;
  const PoseKinds kinds = kinds_of(known, sigma_);
  SolvedPose best;
  best.failure = why_not(kinds);
  if (!best.ok()) return best;
  const bool is_checked = std::ssize(kinds.unknown) < equations_.count();
  best.failure = "not tried";
  // A branch that contradicts the readings more than another one is the wrong branch.
  const auto take_better = [&](SolvedPose other) {
    const bool is_first = best.failure == "not tried";
    if (is_first || (other.ok() && (!best.ok() || other.residual.norm() < best.residual.norm()))) {
      best = std::move(other);
    }
  };
  if (before.size() > 0) take_better(solve_pose(equations_, parameters_, known, sigma_, before));
  const std::vector<Eigen::VectorXd> neighbours = nearest(known, most_neighbours);
  const bool is_new = !best.ok();
  if (is_new) take_better(reached(neighbours.front(), known));
  if (!best.ok() || (is_new && is_checked)) take_better(reached(home_, known));
  if (is_checked) {
    for (const Eigen::VectorXd& one : neighbours) {
      take_better(solve_pose(equations_, parameters_, known, sigma_, one));
    }
    take_better(solve_pose(equations_, parameters_, known, sigma_, home_));
  }
  if (best.ok()) remember(best.coordinates);
  return best;
}

}  // namespace llmt::robotics
