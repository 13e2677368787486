#include "discovery/second_look.hpp"

#include <algorithm>
#include <array>

#include "discovery/left_out.hpp"
#include "discovery/pose_split.hpp"

namespace llmt::robotics {
namespace {

bool depends_on_weight(const std::string& name) {
  const EffectType& type = effect_type(name);
  return type.weighted || type.elastic || type.adjust || type.family == "backlash_gravity";
}

// Of one joint's angle over its whole range, as the torque of gravity often is.
bool is_slow_in_a_joint(const std::string& name) {
  constexpr std::array<const char*, 6> slow = {"eccentricity", "eccentricity_twice", "counterbalance_spring",
                                               "joint_gain",   "wrist_coupling",     "axis_wobble"};
  return std::ranges::find(slow, effect_type(name).family) != slow.end();
}

}  // namespace

// Whatever changes with time is known as closely as the curve that stands for it.
bool depends_on_time(const std::string& name) {
  const std::string& family = effect_type(name).family;
  return family == "drift" || family == "tracker_knock" || family == "thermal_growth";
}

bool may_be_an_error_of(const std::vector<Hypothesis>& large, const Effect& small) {
  return std::ranges::any_of(large, [&](const Hypothesis& one) {
    const Effect& effect = *one.effect;
    const bool by_weight = depends_on_weight(effect.type);
    return (!effect.at.empty() && effect.at == small.at) ||
           effect_type(effect.type).family == effect_type(small.type).family ||
           (depends_on_time(effect.type) && depends_on_time(small.type)) ||
           (by_weight && (depends_on_weight(small.type) || is_slow_in_a_joint(small.type)));
  });
}

std::optional<SecondLook> look_again(Investigation& investigation, const DiscoveryOptions& options) {
  begin(investigation, "looking at what is left");
  const std::vector<std::size_t>& outliers = investigation.verdict.outliers;
  const Measurements kept = without_rows(investigation.searched, outliers);
  SecondLook look{question(investigation.fitted.robot, {}, kept, options), {}};
  std::erase_if(look.asked.hypotheses, [&](const Hypothesis& one) {
    return one.effect && investigation.implausible.contains(effect_label(*one.effect));
  });
  look.verdict = discovery::search(look.asked.evidence, candidates_of(look.asked), options.search);
  if (look.verdict.answer == discovery::Answer::nothing_missing) return std::nullopt;
  const std::vector<Hypothesis> more = effects_of(look.asked, look.verdict);
  forget_signatures(look.asked);
  // Beside a shape names are guesses.
  if (look.verdict.answer == discovery::Answer::unknown || more.empty()) return look;
  std::vector<Hypothesis> all = investigation.found;
  for (std::size_t e = 0; e < all.size(); ++e) {
    // The fit starts where the one before ended.
    const std::string label = effect_label(*all[e].effect);
    const auto fitted = std::ranges::find(investigation.fitted.robot.effects, label, effect_label);
    if (fitted != investigation.fitted.robot.effects.end()) all[e].effect->values = fitted->values;
  }
  all.insert(all.end(), more.begin(), more.end());
  Calibration fitted = refit(investigation.baseline, all, investigation.searched, outliers, options);
  bool is_refused = false;
  bool is_new = false;
  for (const Effect& effect : too_large(fitted, all)) {
    is_refused = true;
    is_new = investigation.implausible.try_emplace(effect_label(effect), effect).second || is_new;
  }
  if (is_refused) return is_new ? look_again(investigation, options) : std::nullopt;
  std::vector<std::size_t> skipped = outliers;
  std::ranges::sort(skipped);
  const auto error = [&](const Calibration& one) {
    Eigen::VectorXd errors = left_out(one, investigation.searched, skipped);
    for (const std::size_t sample : skipped) errors(static_cast<Eigen::Index>(sample)) = 0.0;
    return errors.squaredNorm();
  };
  if (error(fitted) >= error(investigation.fitted)) return std::nullopt;
  investigation.found = std::move(all);
  investigation.fitted = std::move(fitted);
  return look;
}

}  // namespace llmt::robotics
