#include "report/terms/terms_summary.hpp"

namespace llmt::report {
namespace {

Json found_json(const discovery::FoundTerm& found) {
  Json parameters = Json::array();
  for (const discovery::TermValue& value : found.values) {
    parameters.push_back({{"name", value.name},
                          {"value", value.value},
                          {"unit", value.unit},
                          {"std_error", finite_or_null(value.standard_error)}});
  }
  Json rivals = Json::array();
  bool exact = false;
  for (const discovery::RivalTerms& rival : found.rivals) {
    rivals.push_back(rival.what);
    exact = exact || rival.exact;
  }
  Json json = {{"name", found.family},     {"location", found.location}, {"output", found.output},
               {"formula", found.formula}, {"parameters", parameters},   {"rivals", rivals},
               {"exact_alias", exact},     {"share", found.share},       {"confirmed", found.confirmed}};
  if (!found.inner_state.empty()) {
    json["inner_state"] = found.inner_state;
    json["shown_by"] = found.shown_by;
  }
  if (!found.shrinks_gap) json["shrinks_gap"] = false;
  return json;
}

Json time_json(const discovery::TimeUse& time) {
  return {{"found_out", time.found_out},
          {"step", time.step},
          {"rows_per_sample", time.rows_per_sample},
          {"samples", time.samples},
          {"independent_share", time.independent_share},
          {"correlation_time", time.correlation_time}};
}

Json effects_json(const discovery::Missing& missing) {
  Json effects = Json::array();
  for (const discovery::FoundTerm& found : missing.found) {
    if (!found.generic) effects.push_back(found_json(found));
  }
  return effects;
}

// Shapes without a name, and structure that nothing explains.
Json unknown_json(const discovery::Missing& missing) {
  Json shapes = Json::array();
  const auto add = [&](const std::string& output, const std::vector<std::string>& inputs, const std::string& kind,
                       double share) {
    shapes.push_back(
        {{"acts_on", output}, {"depends_on", inputs}, {"per_turn", nullptr}, {"kind", kind}, {"share", share}});
  };
  for (const discovery::FoundTerm& found : missing.found) {
    if (found.generic) add(found.output, found.inputs, found.formula, found.share);
  }
  for (const discovery::Structure& left : missing.structure) add(left.output, left.inputs, "not explained", left.share);
  return shapes;
}

Json gap_json(const discovery::Missing& missing) {
  Json gaps = Json::array();
  for (const discovery::Gap& gap : missing.gaps) {
    gaps.push_back({{"output", gap.output},
                    {"before", finite_or_null(gap.before)},
                    {"after", finite_or_null(gap.after)},
                    {"noise_floor", finite_or_null(gap.noise_floor)}});
  }
  // Errors of outputs in different units do not add up.
  const auto only = [&](const char* field) { return gaps.size() == 1 ? gaps[0][field] : Json(nullptr); };
  return {{"before", only("before")},
          {"after", only("after")},
          {"noise_floor", only("noise_floor")},
          {"heldout_samples", missing.held_out.size()},
          {"outputs", gaps}};
}

Json parameters_json(const discovery::Missing& missing) {
  Json adjusted = Json::array();
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) {
    const discovery::Parameter& parameter = missing.parameters[k];
    if (!parameter.free) continue;
    adjusted.push_back({{"name", parameter.name},
                        {"value", parameter.value},
                        {"unit", parameter.unit},
                        {"std_error", finite_or_null(missing.standard_errors(k))}});
  }
  return adjusted;
}

}  // namespace

Json terms_json(const TermsSummary& summary) {
  const discovery::Missing& missing = summary.missing;
  const Json unknown = unknown_json(missing);
  Json regions = Json::array();
  for (const GapRegion& region : summary.regions) {
    regions.push_back({{"output", region.output},
                       {"where", region.conditions},
                       {"rows", region.rows},
                       {"mean_gap", region.mean_gap}});
  }
  Json untestable = Json::array();
  for (const discovery::UntestableCause& entry : missing.not_testable) {
    untestable.push_back({{"effect", entry.what}, {"why", entry.why}});
  }
  Json visible = Json::array();
  for (const discovery::VisibleTerm& term : missing.visible) {
    visible.push_back(
        {{"effect", term.what}, {"amplitude", finite_or_null(term.coefficient)}, {"rms", finite_or_null(term.rms)}});
  }
  Json json = {{"verdict", discovery::to_string(missing.answer)},
               {"effects", effects_json(missing)},
               {"unknown", unknown.empty() ? Json(nullptr) : unknown[0]},
               {"unknown_all", unknown},
               {"simulation", parameters_json(missing)},
               {"gap", gap_json(missing)},
               {"regions", regions},
               {"outliers", missing.outliers},
               {"notes", missing.notes},
               {"not_testable", untestable},
               {"smallest_visible", visible},
               {"score_gain", missing.verdict.score_gain},
               {"chance_threshold", missing.verdict.threshold},
               {"hypotheses", missing.candidates.size()},
               {"rounds", missing.rounds}};
  if (!missing.outliers.empty()) json["outlier_lines"] = summary.outlier_lines;
  if (!missing.failing_rows.empty()) json["failing_lines"] = summary.failing_lines;
  if (missing.time.in_time) json["time"] = time_json(missing.time);
  return json;
}

}  // namespace llmt::report
