#include "discovery/could_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "discovery/investigation/pose_split.hpp"
#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {
namespace {

bool has_effect(const Robot& robot, const auto& is_meant) {
  return std::ranges::any_of(robot.effects, [&](const Effect& own) { return is_meant(own); });
}

bool changes_payload(const EffectType& type) { return type.adjust && type.parameters.front().unit == "kg"; }

std::optional<std::string> payload_to_state(const Robots& robots, const PoseSplit& split, const Findings& found,
                                            const DiscoveryOptions& options) {
  constexpr double material = 0.05;
  constexpr double start_kg = 1.0;
  const Robot& improved = robots.improved.robot;
  const bool is_stated = improved.chain.payload.mass_kg > 0.0 || split.samples.poses.covariates.contains("payload_kg");
  const auto bends = [](const Effect& own) { return effect_type(own.type).scales_with_mass; };
  const auto is_payload = [](const Effect& own) { return changes_payload(effect_type(own.type)); };
  if (is_stated || split.test.count() < 3 || !has_effect(improved, bends) || has_effect(improved, is_payload))
    return {};
  Robot loaded = improved;
  loaded.chain.payload.mass_kg = start_kg;  // the effect changes a payload that is there
  const EffectType& payload = *std::ranges::find_if(effect_types(), changes_payload);
  loaded.effects.push_back({payload.name, "", std::vector<double>(payload.parameters.size(), 0.0)});
  const Measurements kept = without_rows(split.samples, found.investigation.verdict.outliers);
  const Calibration fitted = calibrate(loaded, kept, options.calibration);
  const Eigen::VectorXd without = distances(positions(robots.improved, split.test.poses), split.test);
  const Eigen::VectorXd with =
      distances(positions({fitted.robot, robots.improved.correction}, split.test.poses), split.test);
  const PairedDifference gain = paired_difference(without, with);
  const double mass = start_kg + fitted.robot.effects.back().values[0];
  if (!(mass > 0.0) || !gain.is_beyond_chance() || gain.mean < material * without.mean()) return {};
  return fmt::format(
      "State the payload (payload of the description, or a column payload_kg): with {:.3g} kg the poses set aside "
      "would be missed by {:.4f} instead of {:.4f} mm.",
      mass, with.mean(), without.mean());
}

}  // namespace

std::vector<std::string> could_state(const Robots& robots, const PoseSplit& split, const Findings& found,
                                     const DiscoveryOptions& options) {
  std::vector<std::string> sentences;
  if (const auto payload = payload_to_state(robots, split, found, options)) sentences.push_back(*payload);
  const auto has_no_masses = [](const Effect& own) { return effect_type(own.type).parameters.front().each_body; };
  if (has_effect(robots.improved.robot, has_no_masses)) {
    sentences.emplace_back(
        "State the masses of the links and their centres (mass_kg, com_mm): a compliance then has a value, and holds "
        "under other loads.");
  }
  return sentences;
}

}  // namespace llmt::robotics
