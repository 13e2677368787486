// What the samples set aside, and the errors of the inputs, say of the terms found.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "discovery/answer/findings.hpp"
#include "discovery/answer/judges.hpp"
#include "discovery/answer/question.hpp"
#include "discovery/recording/derivatives.hpp"

namespace llmt::discovery {
namespace {

// Squared errors of the samples.
Eigen::VectorXd squared_errors(const TermModel& model, const TermData& data, const TermFit& fit) {
  const Eigen::VectorXd errors = scaled_residuals(model, data, fit.parameters, fit.placed);
  const Eigen::Index d = data.measured.cols();
  return errors.reshaped(d, data.samples.size()).colwise().squaredNorm();
}

// Samples that are far off with the terms and without them say nothing of either. Where they are many, the noise is no
// measure of what is left.
TermData without_outliers(const TermData& data, const Eigen::VectorXd& before, const Eigen::VectorXd& after,
                          double noise) {
  const double limit = far_off * far_off * noise * static_cast<double>(data.measured.cols());
  std::vector<std::size_t> outliers;
  for (Eigen::Index i = 0; i < before.size(); ++i) {
    if (std::min(before(i), after(i)) > limit) outliers.push_back(static_cast<std::size_t>(i));
  }
  return static_cast<double>(outliers.size()) > largest_share_of_outliers * static_cast<double>(before.size())
             ? data
             : without_samples(data, outliers);
}

TermFit fit_without(const TermModel& model, const TermData& kept, const TermFit& fit, std::size_t term) {
  std::vector<PlacedTerm> rest = fit.placed;
  rest.erase(rest.begin() + static_cast<Eigen::Index>(term));
  return fit_terms(model, kept, fit.parameters, rest);
}

// Terms that change samples by C, a sum of squares in units of the variance of the noise, should shrink the sum of
// squares there by C, with a standard deviation of 2 sqrt(C). Where only a share of the samples is independent, both
// sums are of that share. Errors of the inputs make C larger on average, and what is left; both are taken off. By
// chance they change what is left with a standard deviation of 2 sqrt(errors): twice that does not say that a term is
// wrong.
struct Judgement {
  double change = 0.0;
  double shrunk = 0.0;
  double errors = 0.0;  // their part of C

  // Samples that terms hardly reach cannot judge them.
  bool is_possible() const { return change > 4.0; }
  bool shrinks() const { return shrunk > -4.0 * std::sqrt(errors); }
  bool refutes() const { return !shrinks() && shrunk < change - 6.0 * std::sqrt(std::max(0.0, change + errors)); }
};

// Rows of the samples that make up most of the growth of the error.
std::vector<Eigen::Index> rows_of_growth(const Samples& samples, const Eigen::VectorXd& growth) {
  constexpr std::size_t most = 10;
  constexpr double large = 0.1;  // of all that grew
  std::vector<Eigen::Index> order(growth.size());
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::ranges::stable_sort(order, std::greater<>{}, [&](Eigen::Index i) { return growth(i); });
  const double all = growth.cwiseMax(0.0).sum();
  std::vector<Eigen::Index> rows;
  for (const Eigen::Index i : order) {
    if (!rows.empty() && (growth(i) < large * all || rows.size() >= most)) break;
    for (const Eigen::Index row : samples.rows_of(i)) rows.push_back(row);
  }
  return rows;
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

}  // namespace

void judge_held_out(const TermModel& model, const TermData& kept, const TermData& aside, const TermFit& baseline,
                    const Settled& settled, const InputNoise* errors, Missing& missing) {
  if (aside.samples.size() == 0 || settled.fit.placed.empty()) return;
  const double variance = std::pow(settled.verdict.noise, 2.0);
  const double noise = variance / kept.independent_share;
  const TermData held_out = without_outliers(aside, squared_errors(model, aside, baseline),
                                             squared_errors(model, aside, settled.fit), variance);
  const Eigen::VectorXd before = squared_errors(model, held_out, baseline);
  const Eigen::VectorXd after = squared_errors(model, held_out, settled.fit);
  const Eigen::VectorXd change = scaled_residuals(model, held_out, baseline.parameters, baseline.placed) -
                                 scaled_residuals(model, held_out, settled.fit.parameters, settled.fit.placed);
  const Eigen::MatrixXd simulated = model.simulated(settled.fit.parameters);
  // A state answers to errors of the inputs at its own frequency, many times over. Of other terms they are a small
  // part.
  const auto added_to = [&](std::vector<PlacedTerm> terms) {
    std::erase_if(terms, [&](const PlacedTerm& own) { return model.terms()[own.term].inner_state.empty(); });
    return errors != nullptr && !terms.empty() ? errors->added(held_out, terms, simulated)
                                               : InputNoise::AddedByErrors{};
  };
  const auto judgement_of = [&](double changed, double shrunk, const InputNoise::AddedByErrors& added) {
    return Judgement{(changed - added.change) / noise, (shrunk + added.left) / noise, added.change / noise};
  };
  const Judgement all = judgement_of(change.squaredNorm(), before.sum() - after.sum(), added_to(settled.fit.placed));
  if (all.is_possible() && !all.shrinks()) missing.failing_rows = rows_of_growth(held_out.samples, after - before);
  for (std::size_t t = 0; t < settled.fit.placed.size(); ++t) {
    const PlacedTerm& placed = settled.fit.placed[t];
    const Eigen::VectorXd own = stacked_signature(model, held_out, placed, simulated) * placed.coefficients;
    const InputNoise::AddedByErrors added = added_to({placed});
    const bool in_time = !kept.stretches.empty();
    if (!judgement_of(own.squaredNorm(), 0.0, added).is_possible() && !in_time) continue;
    const double without = squared_errors(model, held_out, fit_without(model, kept, settled.fit, t)).sum();
    const Judgement judgement = judgement_of(own.squaredNorm(), without - after.sum(), added);
    for (FoundTerm& found : missing.found) {
      const bool is_this = found.term == placed.term && found.output_index == placed.output &&
                           found.constants.size() == placed.constants.size() && found.constants == placed.constants;
      if (!is_this) continue;
      found.shrinks_gap = judgement.is_possible() && judgement.shrinks();
      found.is_refuted = judgement.refutes();
    }
  }
}

void find_states_of_outputs(const Recording& recording, const MeasuredOutputs& measured, Missing& missing) {
  if (missing.found.empty()) return;
  const Inputs& inputs = recording.inputs();
  const Derivatives& derivatives = recording.derivatives();
  for (FoundTerm& found : missing.found) {
    if (found.generic || found.inputs.size() != 1) continue;
    const auto place = std::ranges::find(inputs.names, found.inputs.front()) - inputs.names.begin();
    if (!is_derivative_of(derivatives, inputs.values.col(place), measured.values.col(found.output_index))) continue;
    found.inner_state = "the output depends on its own derivative " + found.inputs.front() +
                        ", as with a delay, clocks that differ, or a spring or damper behind it";
    found.shown_by = "a signal measured behind it, or a step on the clocks of all signals";
  }
}

void doubt_uncorrected(const ErrorsOfInputs& errors, Missing& missing) {
  for (std::size_t k = 0; k < missing.found.size(); ++k) {
    const FoundTerm& found = missing.found[k];
    std::string label = found.family;
    if (!found.location.empty()) label += " " + found.location;
    if (missing.gaps.size() > 1) label += " on " + found.output;
    if (std::ranges::find(errors.uncorrected, label) == errors.uncorrected.end()) continue;
    object(missing, Reason::errors_of_inputs, {k});
    missing.notes.push_back(
        fmt::format("{}: errors of the inputs are more than half of it, so they alone could make this term", label));
  }
}

std::set<std::size_t> beyond_constants(const Missing& missing, const std::vector<ModelTerm>& terms) {
  std::set<std::size_t> beyond;
  for (const FoundTerm& found : missing.found) {
    const ModelTerm& term = terms[found.term];
    for (Eigen::Index k = 0; k < found.constants.size() && !term.inner_state.empty(); ++k) {
      const std::vector<double>& tried = term.constants[static_cast<std::size_t>(k)].tried;
      const bool is_below = k == 0 && found.constants(k) <= tried.front();
      const Eigen::Index coefficients = found.whole ? 0 : found.coefficients.size();
      const double error = found.values[static_cast<std::size_t>(coefficients + k)].standard_error;
      const double margin = k > 0 ? certainly * error : 0.0;
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

}  // namespace llmt::discovery
