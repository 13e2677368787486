#include "discovery/terms/term_rounds.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "discovery/terms/correlation.hpp"
#include "discovery/terms/term_question.hpp"
#include "llmt/discovery/rounds.hpp"

namespace llmt::discovery {
namespace {

// A search, and the fit after it, count as this share of the work that is left: the number of rounds is not known.
constexpr double share_of_half_a_round = 0.2;

std::vector<PlacedTerm> found_terms(const TermQuestion& question, const Verdict& verdict) {
  std::vector<PlacedTerm> found;
  for (const Finding& finding : verdict.findings) {
    for (const FindingTerm& term : finding.terms) {
      found.push_back(question.options[term.candidate]);
      found.back().coefficients = term.values;
    }
  }
  return found;
}

RoundSummary summary_of(const Settled& settled) {
  RoundSummary summary;
  for (const PlacedTerm& placed : settled.fit.placed) {
    summary.names.insert(fmt::format("term {} on output {}", placed.term, placed.output));
  }
  summary.outliers.insert(settled.verdict.outliers.begin(), settled.verdict.outliers.end());
  return summary;
}

// The share of the samples that is independent, of the outputs together.
double share_of_independent(const TermModel& model, const TermData& data, const TermFit& fit) {
  double shares = 0.0;
  const std::vector<std::vector<double>> correlations =
      correlations_of(data, scaled_residuals(model, data, fit.parameters, fit.placed));
  for (const std::vector<double>& own : correlations) shares += independent_share(own);
  return shares / static_cast<double>(correlations.size());
}

// The weights of the outputs, and the share of the samples that is independent, follow what each round leaves.
Settled search_until_settled(const TermModel& model, TermData& data, const std::vector<Eigen::Index>& repeats,
                             Settled settled, bool with_history, const InputNoise* noise, const MissingOptions& options,
                             Work& work) {
  const bool in_time = !data.stretches.empty();
  constexpr int fewest_in_time = 8;
  const RoundLimits limits{.most = in_time ? std::max(options.rounds, fewest_in_time) : options.rounds,
                           .stop_at_repeat = in_time};
  until_settled(limits, settled.rounds > 0 ? summary_of(settled) : RoundSummary{}, [&](int) {
    if (settled.rounds > 0 && data.sigma.size() > 1) {
      data.sigma = scatter(model, without_samples(data, settled.verdict.outliers), settled.fit);
    }
    work.begin(fmt::format("searching, round {}", ++settled.rounds));
    settled.question = ask(model, data, settled.fit, repeats, settled.verdict.outliers, with_history, noise);
    settled.verdict = search(settled.question.evidence, settled.question.candidates, options.search);
    work.did(share_of_half_a_round * work.left());
    const TermData kept = without_samples(data, settled.verdict.outliers);
    settled.fit = fit_terms(model, kept, settled.fit.parameters, found_terms(settled.question, settled.verdict));
    if (retry_constants(model, kept, settled.fit)) {
      settled.fit = fit_terms(model, kept, settled.fit.parameters, settled.fit.placed);
    }
    work.did(share_of_half_a_round * work.left());
    RoundSummary summary = summary_of(settled);
    if (in_time) {
      const double share = share_of_independent(model, kept, settled.fit);
      constexpr double same = 0.1;
      summary.may_be_last = std::abs(share - data.independent_share) <= same * data.independent_share;
      data.independent_share = share;
    }
    return summary;
  });
  return settled;
}

// The fit with the best two terms without a constant in the place of term t of one input; empty: there are no two.
std::vector<PlacedTerm> with_plain_terms(const TermModel& model, const TermData& kept, const TermFit& fit,
                                         std::size_t t) {
  const ModelTerm& own = model.terms()[fit.placed[t].term];
  std::vector<PlacedTerm> rest = fit.placed;
  rest.erase(rest.begin() + static_cast<Eigen::Index>(t));
  std::vector<PlacedTerm> plain;
  for (std::size_t k = 0; k < model.terms().size(); ++k) {
    const ModelTerm& term = model.terms()[k];
    const bool is_there = std::ranges::any_of(
        rest, [&](const PlacedTerm& placed) { return placed.term == k && placed.output == fit.placed[t].output; });
    if (term.inputs != own.inputs || term.generic || term.history || !term.constants.empty() || model.is_refuted(k) ||
        term.coefficients.size() != 1 || is_there) {
      continue;
    }
    plain.push_back({k, fit.placed[t].output, {}, Eigen::VectorXd::Zero(1), 0.0});
  }
  const Eigen::MatrixXd simulated = model.simulated(fit.parameters);
  const Eigen::VectorXd left = scaled_residuals(model, kept, fit.parameters, rest);
  double least = left.squaredNorm();
  std::vector<PlacedTerm> best;
  for (std::size_t a = 0; a < plain.size(); ++a) {
    for (std::size_t b = a + 1; b < plain.size(); ++b) {
      Eigen::MatrixXd columns(left.size(), 2);
      columns << stacked_signature(model, kept, plain[a], simulated),
          stacked_signature(model, kept, plain[b], simulated);
      const double own_left = (left - columns * columns.colPivHouseholderQr().solve(left)).squaredNorm();
      if (!(own_left < least)) continue;
      least = own_left;
      best = rest;
      best.push_back(plain[a]);
      best.push_back(plain[b]);
    }
  }
  return best;
}

// Score of a fit (Schwarz) with this share of the samples independent.
double score_of(const TermModel& model, const TermData& kept, const TermFit& fit, double share) {
  const double left = scaled_residuals(model, kept, fit.parameters, fit.placed).squaredNorm();
  const auto n = static_cast<double>(kept.samples.size() * kept.measured.cols());
  double taken = 0.0;
  for (const PlacedTerm& placed : fit.placed) {
    taken += static_cast<double>(placed.coefficients.size() + placed.constants.size());
  }
  return share * n * std::log(left / (n - taken)) + taken * std::log(share * n);
}

// What a term misses is alike in neighbours, so that few samples seem to be independent and a better set of terms does
// not seem to be worth its cost. Searches once more from a set with plain terms in the place of one with a constant. It
// is taken if more samples are independent then, and it is better by the rivals' margin with these.
void leave_poor_terms(const TermModel& model, TermData& data, const std::vector<Eigen::Index>& repeats,
                      Settled& settled, const InputNoise* noise, const MissingOptions& options, Work& work) {
  for (std::size_t t = 0; t < settled.fit.placed.size(); ++t) {
    const ModelTerm& term = model.terms()[settled.fit.placed[t].term];
    if (term.constants.empty() || term.inputs.size() != 1 || term.generic) continue;
    const TermData kept = without_samples(data, settled.verdict.outliers);
    const std::vector<PlacedTerm> plain = with_plain_terms(model, kept, settled.fit, t);
    if (plain.empty()) continue;
    Settled other = settled;
    other.fit = fit_terms(model, kept, settled.fit.parameters, plain);
    TermData again = data;
    again.independent_share = share_of_independent(model, kept, other.fit);
    if (!(again.independent_share > data.independent_share)) continue;
    other = search_until_settled(model, again, repeats, std::move(other), false, noise, options, work);
    const double share = again.independent_share;
    if (!(share > data.independent_share)) continue;
    std::vector<std::size_t> outliers = settled.verdict.outliers;
    outliers.insert(outliers.end(), other.verdict.outliers.begin(), other.verdict.outliers.end());
    const TermData of_both = without_samples(data, outliers);
    if (score_of(model, of_both, other.fit, share) + options.search.rival_margin <
        score_of(model, of_both, settled.fit, share)) {
      data = again;
      settled = other;
      return;
    }
  }
}

// Whether terms that depend on earlier rows explain better than what rows explain by themselves.
bool needs_history(const TermModel& model, const Settled& plain, const Settled& with_history, double margin) {
  const bool has_history = std::ranges::any_of(
      with_history.fit.placed, [&](const PlacedTerm& placed) { return model.terms()[placed.term].history; });
  if (!has_history) return false;
  const bool names_more = plain.verdict.answer == Answer::unknown && with_history.verdict.answer != Answer::unknown;
  return names_more || with_history.verdict.score_gain > plain.verdict.score_gain + margin;
}

}  // namespace

Eigen::VectorXd scatter(const TermModel& model, const TermData& data, const TermFit& fit) {
  const Eigen::MatrixXd predicted = means(model.predict(fit.parameters, fit.placed), data.samples);
  Eigen::VectorXd sigma(data.measured.cols());
  for (Eigen::Index o = 0; o < sigma.size(); ++o) {
    const Eigen::VectorXd left = data.measured.col(o) - predicted.col(o);
    sigma(o) = std::sqrt(left.squaredNorm() / static_cast<double>(left.size()));
    if (!(sigma(o) > 0.0)) sigma(o) = 1.0;
  }
  return sigma;
}

Settled search_terms(const TermModel& model, TermData& data, const std::vector<Eigen::Index>& repeats,
                     const TermFit& baseline, const InputNoise* noise, const MissingOptions& options, Work& work) {
  Settled settled;
  settled.fit = baseline;
  settled = search_until_settled(model, data, repeats, std::move(settled), false, noise, options, work);
  if (data.stretches.empty() && std::ranges::any_of(model.terms(), &ModelTerm::history)) {
    TermData again = data;
    const Settled other = search_until_settled(model, again, repeats, settled, true, noise, options, work);
    if (needs_history(model, settled, other, options.search.rival_margin)) {
      data = again;
      settled = other;
    }
  }
  if (!data.stretches.empty()) leave_poor_terms(model, data, repeats, settled, noise, options, work);
  set_trial_errors(model, without_samples(data, settled.verdict.outliers), settled.fit);
  return settled;
}

}  // namespace llmt::discovery
