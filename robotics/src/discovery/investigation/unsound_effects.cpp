#include "discovery/investigation/unsound_effects.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/free_parameters.hpp"
#include "calibration/travel.hpp"
#include "discovery/investigation/jacobian_range.hpp"
#include "discovery/investigation/pose_split.hpp"
#include "linear_algebra/linear_algebra.hpp"

namespace llmt::robotics {
namespace {

bool is_within_limits(const Calibration& fitted, const Effect& effect, const discovery::EffectCandidate& limits) {
  const std::vector<discovery::Parameter> all = parameters(fitted.robot);
  const std::vector<EffectParameter> own = effect_parameters(fitted.robot.chain, effect);
  for (std::size_t k = 0; k < own.size(); ++k) {
    const std::string name = effect_parameter_name(effect, own[k]);
    const auto index = std::ranges::find(all, name, &discovery::Parameter::name) - all.begin();
    const double error = fitted.result.standard_errors(index);
    const double slack = std::isfinite(error) ? 2.0 * error : 0.0;
    const auto i = static_cast<Eigen::Index>(k);
    const bool is_within = effect.values[k] + slack >= limits.lower(i) && effect.values[k] - slack <= limits.upper(i);
    if (!is_within) return false;
  }
  return true;
}

// The robot with all values of the effect at 0.
Robot without_effect(Robot robot, const Effect& effect) {
  std::ranges::fill(std::ranges::find(robot.effects, effect_label(effect), effect_label)->values, 0.0);
  return robot;
}

// For effects whose values have no limits, which are moments in rad. Beyond geometry all effects together move the tool
// as far as the baseline misses. One that moves it twice as far is cancelled by others: the poses determine the sum,
// but not the parts. No weight turns a joint by a tenth of a radian, although that may hardly show where the tool lies
// near the axis; and no effect moves a tool by a fiftieth of the arm's reach, even where a change of geometry takes it
// back.
bool is_of_plausible_size(const Robot& robot, const Effect& effect, const Measurements& kept, double missing) {
  constexpr double most_cancelled = 2.0;
  constexpr double most_of_reach = 0.02;
  constexpr double most_rad = 0.1;
  const auto is_too_large = [](double value) { return !(std::abs(value) <= most_rad); };
  if (std::ranges::any_of(effect.values, is_too_large)) return false;
  const Eigen::MatrixXd moved = positions(robot, kept.poses) - positions(without_effect(robot, effect), kept.poses);
  const double typical = moved.norm() / std::sqrt(static_cast<double>(kept.count()));
  return typical <= most_of_reach * (reach_of(robot.chain) + travel_of(robot.chain, kept.poses)) &&
         beyond_geometry(robot, effect, kept).norm() <= most_cancelled * missing;
}

}  // namespace

double total_distance(const Robot& robot, const Measurements& measurements) {
  return distances(positions(robot, measurements.poses), measurements).norm();
}

Eigen::VectorXd beyond_geometry(const Robot& robot, const Effect& effect, const Measurements& measurements) {
  const Robot without = without_effect(robot, effect);
  const std::vector<Eigen::Index> rows = measured_rows(measurements);
  Eigen::VectorXd moved = stacked(positions(robot, measurements.poses) - positions(without, measurements.poses), rows);
  std::vector<Eigen::Index> geometry = freed_parameters(robot);
  std::erase_if(geometry, [&](Eigen::Index k) { return k >= geometric_parameter_count(robot.chain); });
  const Eigen::MatrixXd basis = range_of(rows_of(position_jacobian(without, measurements.poses, geometry), rows));
  remove_range(basis, moved);
  return moved;
}

std::vector<Effect> unsound(const Calibration& baseline, const Calibration& fitted,
                            const std::vector<Hypothesis>& found, const Measurements& kept) {
  const double missing = total_distance(baseline.robot, kept);
  const bool is_better = total_distance(fitted.robot, kept) <= missing;  // false if it is not finite
  std::vector<Effect> refused;
  for (const Hypothesis& hypothesis : found) {
    const auto effect = std::ranges::find(fitted.robot.effects, effect_label(*hypothesis.effect), effect_label);
    if (effect == fitted.robot.effects.end()) continue;
    const bool is_plausible = hypothesis.candidate.lower.size() == 0
                                  ? is_of_plausible_size(fitted.robot, *effect, kept, missing)
                                  : is_within_limits(fitted, *effect, hypothesis.candidate);
    if (!is_better || !is_plausible) refused.push_back(*effect);
  }
  return refused;
}

}  // namespace llmt::robotics
