#include "discovery/terms/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "discovery/terms/outliers.hpp"
#include "discovery/terms/term_question.hpp"

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

}  // namespace llmt::discovery
