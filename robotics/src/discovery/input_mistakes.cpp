#include "discovery/input_mistakes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "discovery/investigation/pose_split.hpp"
#include "linear_algebra/linear_algebra.hpp"
#include "llmt/robotics/calibration_quality.hpp"

namespace llmt::robotics {
namespace {

using Notes = std::vector<std::string>;

double mass_of(const Chain& chain) {
  double sum = 0.0;
  for (const Joint& joint : chain.joints) sum += joint.mass_kg;
  return sum;
}

// No arm carries three times its own weight, nor three tons.
Notes mistaken_payload(const Robot& described, const Measurements& measurements) {
  const auto column = measurements.poses.covariates.find("payload_kg");
  if (column == measurements.poses.covariates.end()) return {};
  constexpr double heaviest_kg = 3000.0;
  constexpr double most_times = 3.0;
  const double largest = column->second.maxCoeff();
  const double weight = mass_of(described.chain);
  if (largest <= heaviest_kg && !(weight > 0.0 && largest > most_times * weight)) return {};
  return {fmt::format("payload_kg reaches {:.4g} kg{}: is it in grams?", largest,
                      weight > 0.0 ? fmt::format(", and the links weigh {:.4g} kg", weight) : "")};
}

// Sum of squares that geometry, and a compliance of each joint under its weight, leave of the errors.
double left_by_compliance(Robot robot, const Calibration& baseline, const Measurements& measurements,
                          const Eigen::Vector3d& gravity) {
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  const Eigen::VectorXd errors =
      stacked(measurements.positions_mm - positions(baseline.robot, measurements.poses), rows);
  std::vector<Eigen::Index> free;
  for (std::size_t k = 0; k < baseline.robot.identified.size(); ++k) {
    if (baseline.robot.identified[k].state == "free") free.push_back(static_cast<Eigen::Index>(k));
  }
  robot.chain.gravity_m_s2 = gravity;
  std::vector<Effect> soft;
  for (const Joint& joint : robot.chain.joints) soft.push_back({"joint_compliance", joint.name, {0.0}});
  Eigen::MatrixXd columns = rows_of(side_by_side(position_jacobian(baseline.robot, measurements.poses, free),
                                                 effect_signatures(robot, soft, measurements.poses)),
                                    rows);
  normalize_columns(columns);
  const Eigen::VectorXd values = least_squares(columns, errors);
  return (errors - columns * values).squaredNorm();
}

// A compliance of every joint is the most that gravity can do. It is tried with gravity along each axis.
Notes mistaken_gravity(const Robot& described, const Investigation& investigation) {
  const Chain& chain = described.chain;
  const bool has_masses = std::ranges::any_of(chain.joints, [](const Joint& joint) { return joint.mass_kg > 0.0; });
  if (!has_masses || !described.effects.empty()) return {};
  const Measurements kept = without_rows(investigation.searched, investigation.baseline_without);
  if (kept.count() < 20) return {};
  const auto left = [&](const Eigen::Vector3d& gravity) {
    return left_by_compliance(investigation.baseline.robot, investigation.baseline, kept, gravity);
  };
  const double as_described = left(chain.gravity_m_s2);
  const double size = chain.gravity_m_s2.norm();
  double best = as_described;
  std::string axis;
  for (int k = 0; k < 3; ++k) {
    // Upside down the same compliances would only change their signs.
    const Eigen::Vector3d other = -size * Eigen::Vector3d::Unit(k);
    if (other.cross(chain.gravity_m_s2).norm() < 0.1 * size * size) continue;
    const double own = left(other);
    if (own < best) {
      best = own;
      axis = std::string(1, "xyz"[k]);
    }
  }
  constexpr double far_better = 0.25;  // half the error
  if (axis.empty() || best > far_better * as_described) return {};
  const auto errors = static_cast<double>(kept.count());
  return {
      fmt::format("If gravity acted along the {} axis of the base, soft joints would leave {:.4f} mm instead of {:.4f} "
                  "mm: is gravity_m_s2 of the description right, does the arm hang or stand on a wall?",
                  axis, std::sqrt(best / errors), std::sqrt(as_described / errors))};
}

// Effects that the description has and whose values, fitted anew, are within two standard errors of nothing.
Notes denied_effects(const Robot& described, const Investigation& investigation) {
  Notes notes;
  const std::vector<discovery::Parameter> all = parameters(investigation.fitted.robot);
  for (const Effect& effect : described.effects) {
    const std::vector<EffectParameter> own = effect_parameters(described.chain, effect);
    bool is_denied = !own.empty();
    for (const EffectParameter& parameter : own) {
      const std::string name = effect_parameter_name(effect, parameter);
      const auto index = std::ranges::find(all, name, &discovery::Parameter::name) - all.begin();
      if (index == std::ssize(all)) return notes;
      const double error = investigation.fitted.result.standard_errors(index);
      const double value = all[static_cast<std::size_t>(index)].value;
      is_denied = is_denied && std::isfinite(error) && error > 0.0 && std::abs(value) < 2.0 * error;
    }
    if (is_denied) {
      notes.push_back(
          fmt::format("The description has {}, but these poses put it at nothing, within two standard errors.",
                      effect_label(effect)));
    }
  }
  return notes;
}

Notes uncovered_poses(const Investigation& investigation, const Measurements& test) {
  const Coverage used = coverage(investigation.fitted, investigation.searched.poses, test.poses);
  if (used.outside.empty()) return {};
  std::vector<std::string> joints;
  for (const Beyond& range : used.beyond) {
    joints.push_back(fmt::format("{} {:.0f} to {:.0f} {} (searched {:.0f} to {:.0f})", range.name, range.used_low,
                                 range.used_high, range.unit, range.measured_low, range.measured_high));
  }
  std::string deviation = fmt::format("{:.4f} mm", used.deviation_outside_mm);
  if (std::ssize(used.outside) < test.count()) {
    deviation += fmt::format(" instead of {:.4f} mm inside", used.deviation_inside_mm);
  }
  return {
      fmt::format("{} of {} test poses lie outside of what was searched: {}. There the parameters alone leave the tool "
                  "uncertain by {} (one standard deviation), and effects that show only there are unknown.",
                  used.outside.size(), test.count(), fmt::join(joints, ", "), deviation)};
}

}  // namespace

Notes input_mistakes(const Robot& described, const Investigation& investigation, const Measurements& test,
                     bool nothing_is_missing) {
  Notes notes;
  const auto add = [&](Notes more) { notes.insert(notes.end(), more.begin(), more.end()); };
  add(mistaken_payload(described, investigation.searched));
  if (!nothing_is_missing) add(mistaken_gravity(described, investigation));
  add(denied_effects(described, investigation));
  add(uncovered_poses(investigation, test));
  return notes;
}

}  // namespace llmt::robotics
