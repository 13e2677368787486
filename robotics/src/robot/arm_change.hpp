// How what effects look at changes as an arm moves a little, and as its payload or gravity changes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/robotics/effect_type.hpp"

namespace llmt::robotics {

/// Mass and mass moment of everything from each link on, the payload included; the last entry is the payload alone.
struct WeightsBeyond {
  std::vector<double> mass_kg;
  std::vector<Eigen::Vector3d> moment_kg_mm;  // mass times centre, in the world frame
};

/// Written into an existing object without allocating memory.
void sum_weights(const PoseContext& pose, WeightsBeyond& weights);

/// Changes per unit of what causes them.
struct ArmChange {
  Motion motion = {};  // of the skeleton; nothing moves if its axis is zero
  bool loads = false;  // what follows is not all zero
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d::Zero();
  double payload_kg = 0.0;
  Eigen::Vector3d payload_centre_mm = Eigen::Vector3d::Zero();  // beyond that by the motion
};

/// Everything moves that the motion moves, gravity and payload included.
ArmChange change_by(const Motion& motion, const PoseContext& pose);

/// Of PoseContext::load at joint j.
Load load_change(const PoseContext& pose, const WeightsBeyond& weights, const ArmChange& change, std::size_t j);

/// One thing in a PoseContext that effects look at: a vector, or a number (torque, mass of the payload).
struct Input {
  enum class Kind {
    torque,
    axis,
    frame,
    origin,
    end,
    centre,
    body,
    force,
    moment,
    gravity,
    base,
    tool,
    payload_centre,
    payload
  };
  Kind kind;
  std::size_t joint = 0;  // or link
  int column = 0;         // of a frame, the rotation of a body, or that of the base

  bool operator==(const Input&) const = default;
};

/// What an effect looks at, and perhaps more: at a joint, a link, or of the whole arm.
std::vector<Input> inputs_of(const Chain& chain, const EffectType& type, std::size_t index,
                             const std::vector<std::size_t>& torques);

/// Where an input stands, so that it can be changed.
struct Place {
  double* numbers;
  int count;                                       // of numbers, or 1 for their part along `axis`
  double step;                                     // small enough for differences
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  // zero: the numbers change one by one

  void shift(int k, double by) const;
};
Place place_of(const Input& input, PoseContext& pose, Skeleton& skeleton, std::vector<Load>& loads);

/// Of an input by a change of the arm; a single number stands first.
Eigen::Vector3d input_change(const PoseContext& pose, const WeightsBeyond& weights, const ArmChange& change,
                             const Input& input);

}  // namespace llmt::robotics
