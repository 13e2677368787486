/// \file
/// The catalogue of robot effects as candidates of llmt::discovery::search, as discover() makes them but without scans
/// and shapes. The generator of the blind test must not include it.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "llmt/discovery/search.hpp"
#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/effects.hpp"
#include "llmt/robotics/measurements.hpp"

namespace blind {

using namespace llmt::robotics;
using Candidate = llmt::discovery::EffectCandidate;
using llmt::discovery::Evidence;

/// The constants of each variant of a type at a place; none if the type cannot be there.
inline std::vector<std::vector<double>> variants(const EffectType& type, const Chain& chain, std::size_t index,
                                                 const Poses& poses) {
  if (type.constants.empty()) return {{}};
  if (type.name == "transmission_error") {
    const auto& ratio = chain.joints[index].gear_ratio;
    return ratio ? std::vector<std::vector<double>>{{*ratio}, {2.0 * *ratio}, {4.0 * *ratio}}
                 : std::vector<std::vector<double>>{};
  }
  if (type.name == "hysteresis") return {{0.005}, {0.015}, {0.04}, {0.1}, {0.3}};
  if (type.name.find("thermal_growth") != std::string::npos) return {{poses.covariates.at("temp_C").mean()}};
  if (type.name == "drift" || type.name == "drift_curved") {
    const auto own = poses.covariates.find("time_s");
    const Eigen::VectorXd& time = own != poses.covariates.end() ? own->second : poses.covariates.at("order");
    return {{time.minCoeff(), time.maxCoeff()}};
  }
  if (type.name == "tracker_knock" || type.name == "joint_map") return {};
  std::vector<double> usual;
  for (const EffectConstant& constant : type.constants) usual.push_back(constant.usual);
  return {usual};
}

/// Effects of the catalogue at every place where they can be, all values 0.
inline std::vector<Effect> catalogue(const Robot& robot, const Poses& poses) {
  std::vector<Effect> effects;
  const Chain& chain = robot.chain;
  for (const EffectType& type : effect_types()) {
    if (!type.searched || type.name == "joint_compliance_free_masses") continue;
    const std::size_t places = type.place == EffectPlace::robot ? 1 : chain.joints.size();
    for (std::size_t index = 0; index < places; ++index) {
      if (!suits(type, chain, index) || !has_columns(type, chain, index, poses)) continue;
      for (const std::vector<double>& constants : variants(type, chain, index, poses)) {
        effects.push_back(make_effect(type, chain, index, constants));
        const auto present = [&](const Effect& own) { return effect_label(own) == effect_label(effects.back()); };
        if (std::ranges::any_of(robot.effects, present)) effects.pop_back();
      }
    }
  }
  return effects;
}

inline Candidate candidate(const Chain& chain, const Effect& effect, Eigen::MatrixXd signature) {
  Candidate result;
  result.family = effect_type(effect.type).family;
  result.location = effect.at;
  if (effect.type == "transmission_error") result.location += fmt::format("[{}]", effect.constants[0]);
  const std::vector<EffectParameter> parameters = effect_parameters(chain, effect);
  result.lower.resize(signature.cols());
  result.upper.resize(signature.cols());
  for (Eigen::Index k = 0; k < signature.cols(); ++k) {
    result.lower(k) = parameters[k].lower;
    result.upper(k) = parameters[k].upper;
  }
  result.signature = std::move(signature);
  return result;
}

inline std::vector<Candidate> candidates_of(const Robot& robot, const std::vector<Effect>& effects,
                                            const Measurements& measurements) {
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  const Eigen::MatrixXd all = effect_signatures(robot, effects, measurements.poses)(rows, Eigen::all);
  std::vector<Candidate> candidates;
  Eigen::Index next = 0;
  for (const Effect& effect : effects) {
    const Eigen::Index k = std::ssize(effect.values);
    candidates.push_back(candidate(robot.chain, effect, all.middleCols(next, k)));
    next += k;
  }
  return candidates;
}

/// Residuals and Jacobian of a calibrated robot.
inline Evidence evidence_of(const Robot& robot, const Measurements& measurements) {
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  const Eigen::MatrixXd model = positions(robot, measurements.poses);
  Evidence evidence;
  evidence.components = std::ssize(rows) / measurements.count();
  evidence.residuals.resize(std::ssize(rows));
  for (Eigen::Index k = 0; k < std::ssize(rows); ++k) {
    const Eigen::Index row = rows[k];
    evidence.residuals(k) = measurements.positions_mm(row / 3, row % 3) - model(row / 3, row % 3);
  }
  evidence.jacobian = position_jacobian(robot, measurements.poses)(rows, Eigen::all);
  return evidence;
}

}  // namespace blind
