#include "discovery/terms/missing_findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "discovery/recording/derivatives.hpp"
#include "discovery/terms/input_noise.hpp"
#include "discovery/terms/outliers.hpp"
#include "discovery/terms/structure.hpp"

namespace llmt::discovery {
namespace {

std::string unit_of(const std::string& output, const std::string& per) {
  if (per.empty()) return output;
  if (per.starts_with("simulated")) return output + "/" + output + per.substr(std::string("simulated").size());
  return output + "/" + per;
}

// What a filtered input changes by from row to row where it passes 0, in the middle of all such steps; 0: not known.
double step_across_zero(const Recording& recording, Eigen::Index column) {
  std::vector<double> steps;
  if (!recording.is_filtered()) return 0.0;
  const Rows& rows = recording.rows();
  const Eigen::MatrixXd& inputs = recording.inputs().values;
  const std::vector<Recorded> recorded = recordings(rows);
  for (std::size_t k = 1; k < rows.sequence.size(); ++k) {
    const double before = inputs(rows.sequence[k - 1], column);
    const double now = inputs(rows.sequence[k], column);
    if (recorded[k].begin == recorded[k - 1].begin && before * now < 0.0) steps.push_back(std::abs(now - before));
  }
  if (steps.empty()) return 0.0;
  const auto middle = steps.begin() + std::ssize(steps) / 2;
  std::ranges::nth_element(steps, middle);
  return *middle;
}

FoundTerm described(const TermModel& model, const PlacedTerm& placed, const Eigen::VectorXd& errors) {
  const ModelTerm& term = model.terms()[placed.term];
  FoundTerm found;
  found.term = placed.term;
  found.family = term.family;
  found.location = term.location;
  found.output = model.outputs()[placed.output];
  found.output_index = placed.output;
  found.formula = term.formula;
  found.inputs = term.inputs;
  found.generic = term.generic;
  found.code = term.code;
  found.inner_state = term.inner_state;
  found.regime = term.regime;
  found.shown_by = term.shown_by;
  found.whole = term.whole;
  for (std::size_t k = 0; k < term.coefficients.size() && !term.whole; ++k) {
    const std::string unit = term.unit.empty() ? unit_of(found.output, term.per) : k == 0 ? term.unit : "";
    found.values.push_back({.name = term.coefficients[k], .unit = unit});
  }
  for (const TermConstant& constant : term.constants) {
    found.values.push_back({.name = constant.name, .unit = constant.unit});
  }
  set_estimates(placed, errors, found);
  return found;
}

}  // namespace

void set_estimates(const PlacedTerm& placed, const Eigen::VectorXd& errors, FoundTerm& found) {
  found.coefficients = placed.coefficients;
  found.constants = placed.constants;
  Eigen::VectorXd all(placed.coefficients.size() + placed.constants.size());
  all << placed.coefficients, placed.constants;
  const Eigen::Index first = found.whole ? placed.coefficients.size() : 0;
  for (std::size_t k = 0; k < found.values.size(); ++k) {
    found.values[k].value = all(first + static_cast<Eigen::Index>(k));
    found.values[k].standard_error = errors(first + static_cast<Eigen::Index>(k));
  }
}

std::string option_label(const TermModel& model, const PlacedTerm& option) {
  std::string text = model.label(option);
  const std::vector<TermConstant>& constants = model.terms()[option.term].constants;
  if (!constants.empty()) text += fmt::format(" ({} = {:.4g})", constants.front().name, option.constants(0));
  return text;
}

void describe_findings(const TermModel& model, const Settled& settled, Missing& missing) {
  std::size_t next = 0;
  for (const Finding& finding : settled.verdict.findings) {
    for (const FindingTerm& term : finding.terms) {
      FoundTerm found = described(model, settled.fit.placed[next], settled.fit.errors[next]);
      ++next;
      found.share = term.share;
      for (const Rival& rival : finding.rivals) {
        RivalTerms terms{.what = {}, .inputs = {}, .exact = rival.exact};
        for (const std::size_t a : rival.candidates) {
          terms.what += (terms.what.empty() ? "" : " + ") + missing.candidates[a];
          for (const std::string& input : model.terms()[settled.question.options[a].term].inputs) {
            if (std::ranges::find(terms.inputs, input) == terms.inputs.end()) terms.inputs.push_back(input);
          }
        }
        found.rivals.push_back(std::move(terms));
      }
      missing.found.push_back(std::move(found));
    }
  }
  std::ranges::stable_sort(missing.found, [](const FoundTerm& a, const FoundTerm& b) {
    return a.generic != b.generic ? b.generic : a.share > b.share;
  });
}

void describe_limits(const Settled& settled, const TermData& data, Missing& missing) {
  const auto n = static_cast<double>(data.samples.size());
  for (std::size_t a = 0; a < settled.question.options.size(); ++a) {
    const EffectCandidate& candidate = settled.question.candidates[a];
    const Sensitivity& own = settled.verdict.sensitivity[a];
    const bool found = std::ranges::any_of(settled.verdict.findings, [&](const Finding& finding) {
      return std::ranges::any_of(finding.terms, [&](const FindingTerm& term) { return term.candidate == a; });
    });
    if (candidate.generic || found) continue;
    if (own.absorbed) {
      missing.not_testable.push_back({missing.candidates[a], candidate.signature.norm() > 0.0
                                                                 ? "the simulation's own parameters imitate it"
                                                                 : "it is zero at every row"});
      continue;
    }
    Eigen::Index k = 0;
    const double visible = own.visible.maxCoeff(&k);
    const double sigma = data.sigma(settled.question.options[a].output);
    missing.visible.push_back(
        {missing.candidates[a], visible, visible * candidate.signature.col(k).norm() / std::sqrt(n) * sigma});
  }
  std::ranges::stable_sort(missing.visible, {}, &VisibleTerm::rms);
}

std::vector<Structure> structure_beside(const TermModel& model, const TermData& data, const Inputs& inputs,
                                        const Eigen::VectorXd& errors, const Missing& missing) {
  constexpr double surprising = 5e-4;
  constexpr double material = 0.05;
  // More than a quarter of what is left: no noise hides what the terms miss, however little of the gap it is.
  constexpr double dominant = 0.25;
  // Signals of a machine always hold a little more than what is asked for.
  constexpr double immaterial = 0.01;
  Eigen::MatrixXd samples = means(inputs.values, data.samples);
  if (!data.stretches.empty()) {
    for (Eigen::Index j = 0; j < errors.size(); ++j) {
      if (!(errors(j) > 0.0)) continue;
      samples.col(j) = between_neighbours(samples.col(j), data.stretches, data.independent_share);
    }
  }
  std::vector<Structure> all;
  for (Eigen::Index o = 0; o < data.measured.cols(); ++o) {
    const auto without = [&](const Eigen::MatrixXd& predicted) -> Eigen::VectorXd {
      const Eigen::VectorXd own = data.measured.col(o) - means_of_filtered(predicted.col(o), data.samples);
      return own.cwiseProduct(weights_of(data, o));
    };
    const Eigen::VectorXd left = without(missing.corrected);
    const Eigen::VectorXd gap = without(missing.before);
    const StructureLeft found = structure_left(samples, left, data.stretches, data.independent_share);
    const double common = found.share * left.squaredNorm();
    const double explained = std::max(0.0, gap.squaredNorm() - left.squaredNorm());
    const double p_value = found.p_value * static_cast<double>(data.measured.cols());
    if (p_value > surprising) continue;
    const double share = common / (common + explained);
    if (share < material && found.share < dominant) continue;
    if (!data.stretches.empty() && share < immaterial) continue;
    Structure structure{model.outputs()[o], {}, p_value, share};
    for (const Eigen::Index j : found.columns) structure.inputs.push_back(inputs.names[j]);
    all.push_back(std::move(structure));
  }
  return all;
}

std::set<std::size_t> beyond_constants(const Missing& missing, const std::vector<ModelTerm>& terms) {
  constexpr double certain = 2.0;  // standard errors
  std::set<std::size_t> beyond;
  for (const FoundTerm& found : missing.found) {
    const ModelTerm& term = terms[found.term];
    for (Eigen::Index k = 0; k < found.constants.size() && !term.inner_state.empty(); ++k) {
      const std::vector<double>& tried = term.constants[static_cast<std::size_t>(k)].tried;
      const bool is_below = k == 0 && found.constants(k) <= tried.front();
      const Eigen::Index coefficients = found.whole ? 0 : found.coefficients.size();
      const double error = found.values[static_cast<std::size_t>(coefficients + k)].standard_error;
      const double margin = k > 0 ? certain * error : 0.0;
      if (is_below || !(found.constants(k) + margin < tried.back())) beyond.insert(found.term);  // NaN at the limit
    }
  }
  return beyond;
}

std::set<std::size_t> narrower_than_errors(const Missing& missing, const std::vector<ModelTerm>& terms,
                                           const Recording& recording, const Eigen::VectorXd& of_smoothed) {
  // Up to 3 the sign of the input may be wrong, and what the simulation has of it.
  constexpr double visible = 4.0;  // standard deviations
  constexpr double smoothed_away = 2.0;
  std::set<std::size_t> narrow;
  const auto has_width = [&](const FoundTerm& found) {
    const std::vector<TermConstant>& constants = terms[found.term].constants;
    return !constants.empty() && constants.front().width;
  };
  if (std::ranges::none_of(missing.found, has_width)) return narrow;
  const std::vector<std::string>& names = recording.inputs().names;
  const Eigen::VectorXd variance = recording.covariance().diagonal();
  for (const FoundTerm& found : missing.found) {
    if (!has_width(found)) continue;
    const auto column = std::ranges::find(names, found.inputs.front()) - names.begin();
    const double least = std::max({visible * std::sqrt(variance(column)), smoothed_away * of_smoothed(column),
                                   step_across_zero(recording, column)});
    if (std::abs(found.constants(0)) < least) narrow.insert(found.term);
  }
  return narrow;
}

std::set<std::size_t> states_by_chance(const Missing& missing) {
  std::set<std::size_t> chance;
  for (const Objection& objection : missing.objections) {
    if (objection.reason != Reason::vague_state && objection.reason != Reason::errors_of_inputs) continue;
    for (const std::size_t k : objection.terms) {
      if (!missing.found[k].inner_state.empty()) chance.insert(missing.found[k].term);
    }
  }
  return chance;
}

bool is_drift(const Missing& missing) {
  constexpr double fewest = 10.0;
  constexpr double slow = 0.5;  // independent share; rows may also be few
  return missing.time.in_time && missing.found.empty() && missing.time.independent_share < slow &&
         missing.time.independent_share * static_cast<double>(missing.time.samples) < fewest;
}

bool is_worse(const Missing& missing) {
  // Without terms there is nothing to leave out; rounding and corrected parameters may differ from the fit before.
  if (missing.found.empty() && missing.answer != Answer::failed_held_out) return false;
  double left = 0.0;
  for (const Gap& gap : missing.gaps) left += gap.after == gap.before ? 1.0 : std::pow(gap.after / gap.before, 2.0);
  return missing.answer == Answer::failed_held_out || left > static_cast<double>(missing.gaps.size());
}

bool may_be_applied(const Missing& missing) {
  const auto outputs = static_cast<double>(missing.gaps.size());
  double left = 0.0;
  for (const Gap& gap : missing.gaps) left += gap.nominal > 0.0 ? std::pow(gap.after / gap.nominal, 2.0) : 1.0;
  switch (missing.answer) {
    case Answer::nothing_missing:
    case Answer::failed_held_out:
      return false;
    case Answer::parameters_only:  // nothing was added, so the simulation as it was given is what counts
      return left <= outputs;
    case Answer::undecided:  // parameters may stand for what is missing
      return 2.0 * left <= outputs;
    default:
      return !is_worse(missing);
  }
}

Gap gap_of(std::string output, const Eigen::VectorXd& nominal, const Eigen::VectorXd& before,
           const Eigen::VectorXd& after, double noise_floor) {
  // A row that only the terms found throw off is no outlier.
  Gap gap{.output = std::move(output),
          .before = 0.0,
          .after = 0.0,
          .noise_floor = noise_floor,
          .outliers = 0,
          .nominal = 0.0};
  Eigen::Index used = 0;
  for (Eigen::Index i = 0; i < before.size(); ++i) {
    if (std::min(std::abs(before(i)), std::abs(after(i))) > far_off * noise_floor) {
      ++gap.outliers;
      continue;
    }
    gap.nominal += nominal(i) * nominal(i);
    gap.before += before(i) * before(i);
    gap.after += after(i) * after(i);
    ++used;
  }
  if (static_cast<double>(gap.outliers) > largest_share_of_outliers * static_cast<double>(before.size())) {
    gap.nominal = nominal.squaredNorm();
    gap.before = before.squaredNorm();
    gap.after = after.squaredNorm();
    gap.outliers = 0;
    used = before.size();
  }
  gap.nominal = std::sqrt(gap.nominal / static_cast<double>(used));
  gap.before = std::sqrt(gap.before / static_cast<double>(used));
  gap.after = std::sqrt(gap.after / static_cast<double>(used));
  return gap;
}

}  // namespace llmt::discovery
