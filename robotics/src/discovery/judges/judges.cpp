#include "discovery/judges/judges.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "calibration/still_joints.hpp"
#include "discovery/judges/residual_tests.hpp"

namespace llmt::robotics {
namespace {

Objection against(Reason reason, const std::vector<Name>& names, const std::function<bool(const Name&)>& is_meant) {
  Objection objection{reason};
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (is_meant(names[k])) objection.names.push_back(k);
  }
  return objection;
}

// A value that was held has no standard error.
bool is_known(const FoundParameter& one) { return one.value != 0.0 && std::abs(one.value) >= 2.0 * one.standard_error; }

bool is_undetermined(const Name& name) { return std::ranges::none_of(name.effect.parameters, is_known); }

// Compliances, by their unit, of gears and controllers. A controller may count torques with either sign, but all with
// one.
bool is_compliance(const Name& name) {
  const std::vector<FoundParameter>& values = name.effect.parameters;
  return values.size() == 1 && values.front().unit.starts_with("rad/(N");
}

bool has_both_signs(const std::vector<Name>& names) {
  const auto has = [&](double sign) {
    return std::ranges::any_of(names, [&](const Name& name) {
      return is_compliance(name) && is_known(name.effect.parameters.front()) &&
             sign * name.effect.parameters.front().value > 0.0;
    });
  };
  return has(1.0) && has(-1.0);
}

// An effect may be a part of a pattern if both depend on the posture, or both on time or load.
bool may_be_part_of(const ErrorPattern& pattern, const Effect& effect) {
  bool posture = true;
  bool load = false;
  for (const std::string& input : pattern.depends_on) {
    load = load || input == "payload_kg";
    posture = posture && input != "time_s" && input != "order" && input != "temp_C" && input != "payload_kg";
  }
  // No smooth pattern and no map follows a wave of many periods.
  constexpr double finest = 90.0;  // waves a turn that knots every two degrees can follow
  if (nature_of(effect) == Nature::wave && effect.constants[0] > finest) return false;
  const std::vector<std::string>& columns = effect_type(effect.type).columns;
  const bool is_of_posture = columns.empty() || columns.front().starts_with("tau");
  if (is_of_posture) return posture || load;
  return !posture && depends_on_time(effect);
}

Objection judge_parts(const Findings& found) {
  const Investigation& last = found.investigation;
  std::vector<FoundPattern> patterns = found_patterns(last.asked.hypotheses, last.verdict);
  patterns.insert(patterns.end(), found.unknown.begin(), found.unknown.end());
  if (found.harmonics)
    patterns.insert(patterns.end(), found.harmonics->unknown.begin(), found.harmonics->unknown.end());
  double in_patterns = 0.0;
  for (const discovery::Finding& finding : last.verdict.findings) in_patterns += finding.generic ? finding.share : 0.0;
  constexpr double most = 0.8;
  return against(Reason::part_of_unknown, found.names, [&](const Name& name) {
    return !(name.family_share > most && in_patterns < 1.0 - most) ||
           std::ranges::any_of(
               patterns, [&](const FoundPattern& one) { return may_be_part_of(one.pattern, name.effect.effect); });
  });
}

}  // namespace

std::vector<Objection> judge_names(const Findings& found, const DiscoveryOptions& options) {
  const auto is_error_of_larger = [&](const Name& name) {
    return name.effect.smaller && name.effect.share < options.search.model_error &&
           may_be_an_error_of(found.larger, name.effect.effect);
  };
  const Investigation& last = found.investigation;
  const std::vector<StillJoint> still = still_joints(last.fitted.robot.chain, last.searched.poses);
  const auto stands_still = [&](const Name& name) {
    return std::ranges::find(still, name.effect.effect.at, &StillJoint::joint) != still.end();
  };
  const bool is_contradiction = has_both_signs(found.names);
  std::vector<Objection> objections = {against(Reason::undetermined, found.names, is_undetermined),
                                       against(Reason::error_of_larger, found.names, is_error_of_larger),
                                       against(Reason::still_joint, found.names, stands_still),
                                       against(Reason::both_signs, found.names, [&](const Name& name) {
                                         return is_contradiction && is_compliance(name);
                                       })};
  if (found.is_beside_unknown()) objections.push_back(judge_parts(found));
  std::erase_if(objections, [](const Objection& one) { return one.names.empty(); });
  return objections;
}

std::optional<Objection> judge_outliers(const Findings& found, const DiscoveryOptions& options) {
  if (found.verdict != discovery::Answer::nothing_missing) return std::nullopt;
  const Investigation& last = found.investigation;
  const Measurements kept = last.kept();
  const double tail = tail_weight(distances(positions(last.fitted.robot, kept.poses), kept),
                                  std::ranges::count(last.searched.measured, true));
  constexpr double heaviest = 1.6;  // Student's t with 4 degrees of freedom: 1.2
  const Eigen::Index outliers = std::ssize(last.verdict.outliers);
  const auto most =
      static_cast<Eigen::Index>(options.search.largest_outlier_share * static_cast<double>(last.searched.count()));
  if (outliers < std::max<Eigen::Index>(most, 3) && tail <= heaviest) return std::nullopt;
  return Objection{Reason::gross_errors,
                   {},
                   {{{"measurements", {}, std::nullopt, "outliers"}, 1.0}},
                   {fmt::format("More measurements fit nothing than can be told from an effect ({} were left out, at "
                                "most {} are): check them before anything else.",
                                outliers, most)}};
}

std::vector<Objection> judge_residuals(const Findings& found, const std::vector<bool>& stands,
                                       const DiscoveryOptions& options) {
  const bool found_nothing = found.verdict == discovery::Answer::nothing_missing;
  const bool explains_all = is_named(found.verdict) && !found.harmonics && patterns_left(found).empty();
  if (!found_nothing && !explains_all) return {};
  const Investigation& last = found.investigation;
  const std::optional<ResidualStructure> structure =
      find_structure(last.fitted, last.searched, last.outliers(), options.seed);
  if (!structure) return {};
  const std::vector<FoundPattern> unexplained = {{{structure->where, {}, std::nullopt, "noise"}, 1.0}};
  if (found_nothing) {
    return {{Reason::structured_residuals,
             {},
             unexplained,
             {fmt::format("No candidate explains it, but {}.", structure->reason)}}};
  }
  const bool is_of_instrument = structure->where == "instrument";
  Objection images = against(Reason::instrument_residuals, found.names, [&](const Name& name) {
    return is_of_instrument && nature_of(name.effect.effect) != Nature::instrument;
  });
  images.notes.push_back(fmt::format("What was found is not all: {}.", structure->reason));
  const std::vector<bool> spared = unopposed({images}, found.names.size());
  bool any_stands = false;
  for (std::size_t k = 0; k < spared.size(); ++k) any_stands = any_stands || (spared[k] && stands[k]);
  if (!is_of_instrument || any_stands) return {images};
  return {images, {Reason::structured_residuals, {}, unexplained}};
}

std::vector<Objection> judge(const Findings& found, const DiscoveryOptions& options) {
  std::vector<Objection> objections = judge_names(found, options);
  if (found.harmonics) objections.push_back(*found.harmonics);
  if (const std::optional<Objection> gross = judge_outliers(found, options)) {
    objections.push_back(*gross);
    return objections;
  }
  for (Objection& one : judge_residuals(found, unopposed(objections, found.names.size()), options)) {
    objections.push_back(std::move(one));
  }
  return objections;
}

}  // namespace llmt::robotics
