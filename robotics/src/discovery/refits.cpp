#include "discovery/refits.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "discovery/investigation/pose_split.hpp"
#include "llmt/folds.hpp"
#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {
namespace {

struct Value {
  double value = 0.0;
  double standard_error = 0.0;
};

// The values of an effect, empty if the fit does not have it.
std::vector<Value> values_of(const Effect& effect, const Calibration& fitted) {
  const std::vector<discovery::Parameter> all = parameters(fitted.robot);
  std::vector<Value> values;
  for (const EffectParameter& parameter : effect_parameters(fitted.robot.chain, effect)) {
    const auto named = std::ranges::find(all, effect_parameter_name(effect, parameter), &discovery::Parameter::name);
    if (named == all.end()) return {};
    values.push_back({named->value, fitted.result.standard_errors(named - all.begin())});
  }
  return values;
}

void add(const Name& name, const Calibration& fitted, NameInRefits& own) {
  const std::vector<Value> values = values_of(name.effect.effect, fitted);
  bool holds = false;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [value, error] = values[k];
    if (own.ranges.size() <= k) own.ranges.push_back({value, value});
    own.ranges[k] = {std::min(own.ranges[k][0], value), std::max(own.ranges[k][1], value)};
    const bool is_known = error > 0.0 && std::abs(value) >= 2.0 * error;
    holds = holds || (is_known && value * name.effect.parameters[k].value > 0.0);
  }
  own.held += holds ? 1 : 0;
}

std::vector<std::size_t> rows_without(Eigen::Index count, const std::vector<Eigen::Index>& kept) {
  std::vector<bool> is_kept(count, false);
  for (const Eigen::Index row : kept) is_kept[row] = true;
  std::vector<std::size_t> rows;
  for (Eigen::Index row = 0; row < count; ++row) {
    if (!is_kept[row]) rows.push_back(static_cast<std::size_t>(row));
  }
  return rows;
}

}  // namespace

Refits refits_of(const Robots& robots, const PoseSplit& split, const Findings& found, const DiscoveryOptions& options) {
  Refits refits;
  const Measurements kept = without_rows(split.samples, found.investigation.verdict.outliers);
  constexpr int folds = 5;
  const bool is_changed = robots.improved.robot.effects.size() != robots.before.effects.size();
  if (!is_changed || kept.count() < 2 * folds) return refits;
  const std::vector<Eigen::Index> repeats = repeats_of(kept.poses);
  const std::vector<double> labels(repeats.begin(), repeats.end());
  refits.names.resize(found.names.size());
  for (const Fold& fold : make_folds(kept.count(), {.count = folds, .seed = options.seed}, labels)) {
    const Measurements fitted_to = without_rows(kept, rows_without(kept.count(), fold.train));
    const Calibration now = calibrate(robots.improved.robot, fitted_to, options.calibration);
    for (std::size_t k = 0; k < found.names.size(); ++k) add(found.names[k], now, refits.names[k]);
    ++refits.count;
  }
  return refits;
}

std::optional<Objection> judge_refits(const Refits& refits) {
  constexpr int may_fail = 1;
  Objection objection{Reason::refits};
  for (std::size_t k = 0; k < refits.names.size(); ++k) {
    if (refits.names[k].held < refits.count - may_fail) objection.names.push_back(k);
  }
  if (refits.count == 0 || objection.names.empty()) return std::nullopt;
  return objection;
}

}  // namespace llmt::robotics
