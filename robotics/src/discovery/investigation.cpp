#include "discovery/investigation.hpp"

#include <fmt/format.h>

#include <set>

#include "calibration/joint_map_shift.hpp"
#include "discovery/joint_maps.hpp"
#include "discovery/pose_split.hpp"

namespace llmt::robotics {
namespace {

std::set<std::string> labels_of(const std::vector<Hypothesis>& found) {
  std::set<std::string> labels;
  for (const Hypothesis& hypothesis : found) labels.insert(effect_label(*hypothesis.effect));
  return labels;
}

// Fits the robot with the found effects, starting from the registered frames. If that is worse than geometry alone, the
// fit is repeated from the calibrated geometry, and the better one is kept.
Calibration refit(const Calibration& baseline, const std::vector<Hypothesis>& found, const Measurements& measurements,
                  const std::vector<std::size_t>& outliers, const DiscoveryOptions& options) {
  const Measurements kept = without_rows(measurements, outliers);
  CalibrationOptions calibration = options.calibration;
  calibration.start_as_given = true;
  const auto from = [&](Robot start) {
    for (const Hypothesis& hypothesis : found) start.effects.push_back(*hypothesis.effect);
    return calibrate(start, kept, calibration);
  };
  Calibration fitted = from(baseline.registered);
  if (total_distance(fitted.robot, kept) <= total_distance(baseline.robot, kept)) return fitted;
  Calibration other = from(baseline.robot);
  return total_distance(other.robot, kept) < total_distance(fitted.robot, kept) ? other : fitted;
}

}  // namespace

void say(const DiscoveryOptions& options, const std::string& stage) {
  if (options.progress) options.progress(stage);
}

double total_distance(const Robot& robot, const Measurements& measurements) {
  return distances(positions(robot, measurements.poses), measurements).norm();
}

void Investigation::search(const DiscoveryOptions& options) {
  if (found.empty()) fitted = baseline;
  for (int round = 0; round < options.rounds; ++round) {
    say(options, fmt::format("searching, round {}", ++rounds));
    asked = question(fitted.robot, found, searched, options);
    verdict = discovery::search(asked.evidence, candidates_of(asked), options.search);
    const std::set<std::string> before = labels_of(found);
    found = effects_of(asked, verdict);
    const bool as_before = found.empty() && verdict.outliers.empty();
    fitted = as_before ? baseline : refit(baseline, found, searched, verdict.outliers, options);
    if (labels_of(found) == before) break;
  }
}

void Investigation::apply(const std::vector<Effect>& maps) {
  Robot mapped = baseline.registered;
  mapped.effects.insert(mapped.effects.end(), maps.begin(), maps.end());
  searched = unmapped(mapped, searched).measurements;
}

void add_maps(Investigation& investigation, const DiscoveryOptions& options, Discovery& result) {
  say(options, "mapping the joints");
  const Measurements kept = without_rows(investigation.searched, investigation.verdict.outliers);
  const std::optional<JointMaps> maps = fit_joint_maps(investigation.fitted.robot, kept);
  constexpr double convincing = 2.0;
  if (!maps || maps->gain_in_errors < convincing) {
    result.notes.emplace_back("Free maps of the joints do not lower the error on poses left out.");
    return;
  }
  result.maps = maps->effects;
  result.notes.push_back(fmt::format(
      "Free maps of {} joints, angle error against angle, lower the leave-one-out error from {:.4f} to {:.4f} mm.",
      maps->effects.size(), maps->before.mean(), maps->after.mean()));
  investigation.apply(maps->effects);
  CalibrationOptions calibration = options.calibration;
  calibration.start_as_given = true;
  investigation.baseline.robot =
      calibrate(investigation.baseline.registered, without_rows(investigation.searched, investigation.verdict.outliers),
                calibration)
          .robot;
  investigation.fitted = refit(investigation.baseline, investigation.found, investigation.searched,
                               investigation.verdict.outliers, options);
  investigation.search(options);
}

}  // namespace llmt::robotics
