// What could be missing from a robot model: the catalogue's effects at every place, and shapes that carry "unknown".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/discovery/search.hpp"
#include "llmt/robotics/discovery.hpp"

namespace llmt::robotics {

/// A candidate of the search and what it means.
struct Hypothesis {
  discovery::Candidate candidate;  ///< signature over all 3n coordinates
  std::optional<Effect> effect;    ///< what would be added to the robot; a shape may have none
  Shape shape;                     ///< of a generic candidate
};

/// What hypotheses are made for.
struct Scene {
  const Robot& robot;  ///< at the current estimates
  const Poses& poses;
  const Eigen::VectorXd& residuals;  ///< 3n: measured - model, zero where not measured
  std::array<bool, 3> measured;
  std::vector<Eigen::MatrixXd>
      lever;                ///< for each joint 3n x 1: motion of the tool by the joint, zero where not measured
  Eigen::VectorXd clipped;  ///< residuals for scans: no sample is longer than some times the median
};

Scene make_scene(const Robot& robot, const Poses& poses, const Eigen::VectorXd& residuals,
                 const std::array<bool, 3>& measured);

/// Plausible limits of an effect's values, by its type.
void set_limits(const EffectType& type, Eigen::Index values, discovery::Candidate& candidate);

/// Effects of the catalogue where they can be, without their signatures; what cannot is told in `untestable`.
std::vector<Hypothesis> catalogue_hypotheses(const Scene& scene, const std::vector<EffectType>& catalogue,
                                             std::vector<Untestable>& untestable);

/// Transmission errors of the orders that the residuals show, tracker knocks at the rows where they show: the best few,
/// each with how many it was chosen from.
std::vector<Hypothesis> scanned_effects(const Scene& scene, const std::vector<EffectType>& catalogue);

/// Shapes: smooth in one joint, local in one joint, of two joints, of the load, of the tool's orientation, of
/// covariates.
std::vector<Hypothesis> shape_hypotheses(const Scene& scene);

/// Signatures of all hypotheses that have an effect.
void add_signatures(const Scene& scene, std::vector<Hypothesis>& hypotheses);

}  // namespace llmt::robotics
