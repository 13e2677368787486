#include "report/robot/discovery/discovery_page.hpp"
#include "report/robot/measurement_text.hpp"

namespace llmt::report {
namespace {

Json effects_json(const robotics::Discovery& found) {
  Json effects = Json::array();
  for (const robotics::FoundEffect& effect : found.effects) {
    Json parameters = Json::array();
    for (const robotics::FoundParameter& parameter : effect.parameters) {
      parameters.push_back({{"name", parameter.name},
                            {"value", parameter.value},
                            {"unit", parameter.unit},
                            {"std_error", finite_or_null(parameter.standard_error)}});
    }
    Json constants = Json::object();
    const robotics::EffectType& type = robotics::effect_type(effect.effect.type);
    for (std::size_t k = 0; k < type.constants.size() && k < effect.effect.constants.size(); ++k) {
      constants[type.constants[k].key] = effect.effect.constants[k];
    }
    effects.push_back({{"name", effect.effect.type},
                       {"family", type.family},
                       {"location", effect.effect.at},
                       {"confirmed", effect.confirmed},
                       {"parameters", parameters},
                       {"constants", constants},
                       {"constant_std_error", effect.constant_error ? Json(*effect.constant_error) : Json(nullptr)},
                       {"rivals", effect.rivals},
                       {"exact_alias", effect.exact_alias},
                       {"smaller", effect.smaller},
                       {"refits", effect.refits},
                       {"held", effect.held},
                       {"share", effect.share},
                       {"rms_mm", effect.rms_mm}});
  }
  return effects;
}

Json patterns_json(const std::vector<robotics::FoundPattern>& list) {
  Json patterns = Json::array();
  for (const robotics::FoundPattern& one : list) {
    patterns.push_back({{"acts_on", one.pattern.acts_on},
                        {"depends_on", one.pattern.depends_on},
                        {"per_turn", one.pattern.per_turn ? Json(*one.pattern.per_turn) : Json(nullptr)},
                        {"kind", one.pattern.kind},
                        {"share", one.share}});
  }
  return patterns;
}

Json beyond_json(const robotics::Discovery& found) {
  Json beyond = Json::array();
  for (const robotics::BeyondPlausible& one : found.beyond_plausible) {
    beyond.push_back({{"name", one.effect.type},
                      {"location", one.effect.at},
                      {"parameter", one.parameter.name},
                      {"value", finite_or_null(one.parameter.value)},
                      {"limit", finite_or_null(one.limit)},
                      {"unit", one.parameter.unit}});
  }
  return beyond;
}

Json gap_json(const robotics::Discovery& found) {
  const bool held_out = found.held_out.poses > 0;
  Json regions = Json::array();
  for (const robotics::GapMap::Region& region : found.gap.regions) {
    regions.push_back({{"conditions", region.conditions}, {"poses", region.poses}, {"mean_mm", region.mean_mm}});
  }
  const auto shares = [](const std::vector<robotics::GapMap::Share>& list) {
    Json all = Json::object();
    for (const robotics::GapMap::Share& share : list) all[share.name] = share.share;
    return all;
  };
  return {{"before_mm", held_out ? found.held_out.before.mean : found.fitted_before.mean},
          {"after_mm", held_out ? found.held_out.after.mean : found.fitted_after.mean},
          {"noise_floor_mm", found.held_out.floor_mm},
          {"heldout_poses", found.held_out.poses},
          {"regions", regions},
          {"along_motion_by", shares(found.gap.acts_like)},
          {"depends_on", shares(found.gap.depends_on)}};
}

}  // namespace

Json discovery_json(const robotics::Discovery& found) {
  Json untestable = Json::array();
  for (const discovery::UntestableCause& entry : found.not_testable) {
    untestable.push_back({{"effect", entry.what}, {"why", entry.why}});
  }
  Json visible = Json::array();
  for (const robotics::Visible& entry : found.visible) {
    visible.push_back({{"effect", entry.what}, {"amplitude", finite_or_null(entry.value)}, {"unit", entry.unit}});
  }
  const Json patterns = patterns_json(found.unknown);
  Json json = {{"verdict", discovery::to_string(found.answer)},
               {"effects", effects_json(found)},
               {"unknown", patterns.empty() ? Json(nullptr) : patterns[0]},
               {"unknown_all", patterns},
               {"more", patterns_json(found.more)},
               {"beyond_plausible", beyond_json(found)},
               {"could_state", found.could_state},
               {"maps", found.maps.size()},
               {"gap", gap_json(found)},
               {"outliers", found.outliers},
               {"not_testable", untestable},
               {"smallest_visible", visible},
               {"noise_mm", found.noise_mm},
               {"score_gain", found.score_gain},
               {"chance_threshold", found.threshold},
               {"hypotheses", found.hypotheses},
               {"notes", found.notes},
               {"rounds", found.rounds}};
  const PairedDifference& gain = found.held_out.gain;
  if (found.withdrawn) json["withdrawn"] = true;
  if (gain.mean != 0.0 && !gain.is_beyond_chance()) {
    json["gain_within_chance"] = {{"mean_mm", gain.mean}, {"standard_error_mm", gain.standard_error}};
  }
  if (!found.still.empty()) json["still_joints"] = still_json(found.still);
  return json;
}

}  // namespace llmt::report
