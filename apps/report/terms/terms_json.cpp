#include "report/terms/expression_code.hpp"
#include "report/terms/term_text.hpp"
#include "report/terms/terms_summary.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace llmt::report {
namespace {

// What expressions call inputs and simulated outputs.
struct Words {
  std::vector<std::string> inputs;
  std::vector<std::string> outputs;
};

Words words_of(const TermsSummary& summary) {
  std::vector<std::string> names = summary.inputs;
  for (const discovery::Gap& gap : summary.missing.gaps) names.push_back(gap.output);
  const std::vector<std::string> words = words_for(names);
  const auto first_output = words.begin() + std::ssize(summary.inputs);
  return {{words.begin(), first_output}, {first_output, words.end()}};
}

std::string number_code(double value) { return value < 0.0 ? fmt::format("({})", value) : fmt::format("{}", value); }

// "0.3*($1 > $c)" with words and numbers in the places of $1, $2, $s, $c to $e; null if there is no expression.
Json expression_json(const discovery::FoundTerm& found, const TermsSummary& summary, const Words& words) {
  if (found.code.empty()) return nullptr;
  std::string text;
  for (std::size_t k = 0; k < found.code.size(); ++k) {
    const std::string& code = found.code[k];
    // A term of the user's own is a sum or a comparison as it stands.
    text += (k > 0 ? " + " : "") + number_code(found.coefficients(static_cast<Eigen::Index>(k))) + "*(";
    for (std::size_t at = 0; at < code.size(); ++at) {
      if (code[at] != '$' || at + 1 == code.size()) {
        text += code[at];
        continue;
      }
      const char what = code[++at];
      if (what == 's') {
        text += words.outputs[static_cast<std::size_t>(found.output_index)];
      } else if (what >= 'c' && what <= 'e') {
        text += number_code(found.constants(what - 'c'));
      } else {
        const std::string& name = found.inputs.at(static_cast<std::size_t>(what - '1'));
        text += words.inputs.at(std::ranges::find(summary.inputs, name) - summary.inputs.begin());
      }
    }
    text += ")";
  }
  return text;
}

// "q" of "q where T > c".
std::string place_without_regime(const std::string& location) {
  const std::size_t end = location.find("where ");
  return location.substr(0, end == 0 ? 0 : end - 1);
}

// Where a term acts alone; null if everywhere.
Json regime_json(const discovery::FoundTerm& found) {
  if (found.regime.empty()) return nullptr;
  return {{"input", found.regime},
          {"threshold", found.constants(found.constants.size() - 1)},
          {"acts", found.location.ends_with("> c") ? "above" : "below"}};
}

// Why a term is not certain.
Json objections_json(const discovery::Missing& missing, std::size_t term) {
  Json reasons = Json::array();
  for (const discovery::Objection& objection : missing.objections) {
    if (std::ranges::find(objection.terms, term) != objection.terms.end())
      reasons.push_back(discovery::to_string(objection.reason));
  }
  return reasons;
}

Json found_json(const discovery::FoundTerm& found, const TermsSummary& summary, const Words& words) {
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
  Json json = {{"name", found.family},
               {"location", found.regime.empty() ? found.location : place_without_regime(found.location)},
               {"output", found.output},
               {"formula", found.formula},
               {"regime", regime_json(found)},
               {"expression", expression_json(found, summary, words)},
               {"parameters", parameters},
               {"rivals", rivals},
               {"exact_alias", exact},
               {"share", found.share},
               {"confirmed", found.confirmed}};
  if (!found.inner_state.empty()) {
    json["inner_state"] = found.inner_state;
    json["shown_by"] = found.shown_by;
  }
  if (!found.shrinks_gap) json["shrinks_gap"] = false;
  return json;
}

Json time_json(const TermsSummary& summary) {
  const discovery::TimeUse& time = summary.missing.time;
  return {{"column", summary.time},
          {"group", summary.group},
          {"found_out", time.found_out},
          {"filtered", time.filtered},
          {"step", time.step},
          {"rows_per_sample", time.rows_per_sample},
          {"samples", time.samples},
          {"independent_share", time.independent_share},
          {"correlation_time", time.correlation_time}};
}

Json effects_json(const TermsSummary& summary, const Words& words) {
  Json effects = Json::array();
  for (std::size_t k = 0; k < summary.missing.found.size(); ++k) {
    const discovery::FoundTerm& found = summary.missing.found[k];
    if (found.generic) continue;
    effects.push_back(found_json(found, summary, words));
    effects.back()["objections"] = objections_json(summary.missing, k);
  }
  return effects;
}

// Shapes without a name, and structure that nothing explains.
Json unknown_json(const TermsSummary& summary, const Words& words) {
  const discovery::Missing& missing = summary.missing;
  Json shapes = Json::array();
  const auto add = [&](const std::string& output, const std::vector<std::string>& inputs, const std::string& kind,
                       double share) {
    shapes.push_back(
        {{"acts_on", output}, {"depends_on", inputs}, {"per_turn", nullptr}, {"kind", kind}, {"share", share}});
  };
  for (const discovery::FoundTerm& found : missing.found) {
    if (!found.generic) continue;
    add(found.output, found.inputs, found.formula, found.share);
    shapes.back()["expression"] = expression_json(found, summary, words);
  }
  for (const discovery::Structure& left : missing.structure) add(left.output, left.inputs, "not explained", left.share);
  return shapes;
}

Json inputs_json(const TermsSummary& summary, const Words& words) {
  Json inputs = Json::array();
  for (std::size_t j = 0; j < summary.ranges.size(); ++j) {
    inputs.push_back({{"name", summary.inputs[j]},
                      {"word", words.inputs[j]},
                      {"low", summary.ranges[j].low},
                      {"high", summary.ranges[j].high}});
    const Eigen::VectorXd& bands = summary.missing.zero_bands;
    const auto column = static_cast<Eigen::Index>(j);
    if (column < bands.size() && bands(column) > 0.0) inputs.back()["zero_band"] = bands(column);
  }
  return inputs;
}

Json outputs_json(const TermsSummary& summary, const Words& words) {
  Json outputs = Json::array();
  for (std::size_t o = 0; o < words.outputs.size(); ++o) {
    outputs.push_back({{"name", summary.missing.gaps[o].output}, {"word", words.outputs[o]}});
    const Eigen::MatrixXd& range = summary.missing.range_of_terms;
    if (range.size() == 0 || !discovery::are_terms_held(summary.missing)) continue;
    const auto row = static_cast<Eigen::Index>(o);
    outputs.back()["terms_low"] = range(row, 0);
    outputs.back()["terms_high"] = range(row, 1);
  }
  return outputs;
}

Json gap_json(const discovery::Missing& missing) {
  Json gaps = Json::array();
  for (const discovery::Gap& gap : missing.gaps) {
    gaps.push_back({{"output", gap.output},
                    {"before", finite_or_null(gap.before)},
                    {"after", finite_or_null(gap.after)},
                    {"noise_floor", finite_or_null(gap.noise_floor)},
                    {"known_noise", finite_or_null(gap.known_noise)},
                    {"outliers", gap.outliers},
                    {"nominal", finite_or_null(gap.nominal)}});
  }
  // Errors of outputs in different units do not add up.
  const auto only = [&](const char* field) { return gaps.size() == 1 ? gaps[0][field] : Json(nullptr); };
  return {{"before", only("before")},
          {"after", only("after")},
          {"noise_floor", only("noise_floor")},
          {"nominal", only("nominal")},
          {"heldout_samples", missing.held_out.size()},
          {"outputs", gaps}};
}

Json parameters_json(const TermsSummary& summary) {
  Json parameters = Json::array();
  for (const discovery::FittedParameter& fitted : summary.missing.fitted_parameters) {
    const bool known = has_nominal(fitted, summary.without_nominal);
    const auto if_known = [&](double value) { return known ? Json(value) : Json(nullptr); };
    parameters.push_back({{"name", fitted.name},
                          {"parts", fitted.parts},
                          {"unit", fitted.unit},
                          {"nominal", if_known(fitted.nominal)},
                          {"value", if_known(fitted.nominal + fitted.change)},
                          {"change", fitted.change},
                          {"std_error", finite_or_null(fitted.standard_error)},
                          {"changed", fitted.changed},
                          {"change_alone", fitted.alone}});
  }
  return parameters;
}

Json simulation_json(const discovery::Missing& missing) {
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
  const Words words = words_of(summary);
  const Json unknown = unknown_json(summary, words);
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
               {"may_be_applied", discovery::may_be_applied(missing)},
               {"effects", effects_json(summary, words)},
               {"unknown", unknown.empty() ? Json(nullptr) : unknown[0]},
               {"unknown_all", unknown},
               {"parameters", parameters_json(summary)},
               {"simulation", simulation_json(missing)},
               {"gap", gap_json(missing)},
               {"regions", regions},
               {"outliers", missing.outliers},
               {"notes", missing.notes},
               {"not_testable", untestable},
               {"smallest_visible", visible},
               {"score_gain", missing.verdict.score_gain},
               {"chance_threshold", missing.verdict.threshold},
               {"hypotheses", missing.candidates.size()},
               {"rounds", missing.rounds},
               {"inputs", inputs_json(summary, words)},
               {"outputs", outputs_json(summary, words)},
               {"order", summary.order}};
  if (!missing.outliers.empty()) json["outlier_lines"] = summary.outlier_lines;
  if (!missing.failing_rows.empty()) json["failing_lines"] = summary.failing_lines;
  if (missing.time.in_time) json["time"] = time_json(summary);
  return json;
}

}  // namespace llmt::report
