// How the frame of an instrument moved while it measured, as points that stand still show it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "llmt/robotics/kinematics.hpp"

namespace llmt::robotics {

/// A reading of a point that stands still.
struct ReferenceReading {
  std::string point;
  double when = 0.0;  ///< place in the sequence of all readings, in any unit
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Index line = 0;  ///< of the file
};

/// The motion of an instrument's frame, round after round: between two rounds it is linear in `when`, before the first
/// and after the last one it rests.
class Drift {
 public:
  /// Fits a motion to each round, and the points' places to all rounds (generalised Procrustes analysis: Gower 1975,
  /// without scale). A motion turns where every round shares with the first one three points that are not on a line;
  /// otherwise it only shifts. Rounds are one or more, in the order of `when`, and share a point with the first one.
  explicit Drift(const std::vector<std::vector<ReferenceReading>>& rounds);

  /// Takes what was read at `when` into the frame of the first round.
  Pose to_first_round(double when) const;

  bool turns() const { return turns_; }

  /// Scatter of a coordinate about the motions, mm; nothing if there are no more readings than unknowns.
  std::optional<double> scatter_mm() const { return scatter_mm_; }

  /// Probability that resting points would seem to move as far (F-test against rest); 0 where there is no scatter.
  double p_value() const { return p_value_; }

  /// Readings that lie more than eight times as far from their place as half of them.
  const std::vector<ReferenceReading>& strays() const { return strays_; }

 private:
  struct Round {
    double when = 0.0;
    Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();  // of the points' centre, since the first round
    Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  // rotation vector, since the first round
  };
  std::vector<Round> rounds_;
  Eigen::Vector3d centre_mm_ = Eigen::Vector3d::Zero();  // of the points, as the first round sees it
  bool turns_ = true;
  std::optional<double> scatter_mm_;
  double p_value_ = 0.0;
  std::vector<ReferenceReading> strays_;
};

}  // namespace llmt::robotics
