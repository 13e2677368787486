// Poses of a mechanism, each on the branch that assemble() describes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mechanism/pose_solver.hpp"

namespace llmt::robotics {

/// Takes one pose after the other; a pose is reached from those before it.
class Assembler {
 public:
  /// Of a validated mechanism. `sigma`: see noise_of(). Throws std::invalid_argument if the start values are near no
  /// configuration.
  Assembler(const Mechanism& mechanism, const Eigen::VectorXd& sigma);

  /// `before`: the configuration of this pose with other parameters; empty if there is none.
  SolvedPose pose(const Eigen::VectorXd& known, const Eigen::VectorXd& before);

  /// A configuration from which poses may be reached.
  void remember(const Eigen::VectorXd& configuration);

 private:
  Equations equations_;
  Eigen::VectorXd parameters_;
  Eigen::VectorXd sigma_;
  Eigen::VectorXd home_;
  std::vector<Eigen::Index> turning_;    // coordinates that are the same after a turn
  std::vector<Eigen::VectorXd> solved_;  // the latest first, behind home

  Eigen::VectorXd turned_to(Eigen::VectorXd configuration, const Eigen::VectorXd& known) const;
  std::vector<Eigen::VectorXd> nearest(const Eigen::VectorXd& known, std::size_t count) const;
  SolvedPose reached(const Eigen::VectorXd& from, const Eigen::VectorXd& known);
  std::string why_not(const PoseKinds& kinds) const;
};

/// assemble() where the configurations with other parameters are known: poses x coordinates, NaN in rows without one.
/// An empty matrix: none is known.
Assembly assemble_again(const Mechanism& mechanism, const Eigen::MatrixXd& known, const Eigen::MatrixXd& before);

}  // namespace llmt::robotics
