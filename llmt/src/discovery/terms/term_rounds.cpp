#include "discovery/terms/term_rounds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "discovery/recording/noise.hpp"
#include "discovery/terms/term_question.hpp"
#include "llmt/discovery/rounds.hpp"
#include "llmt/discovery/search.hpp"

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
                             Settled settled, bool with_history, const KnownErrors& errors,
                             const MissingOptions& options, Work& work) {
  const bool in_time = !data.stretches.empty();
  constexpr int fewest_in_time = 8;
  const RoundLimits limits{.most = in_time ? std::max(options.rounds, fewest_in_time) : options.rounds,
                           .stop_at_repeat = in_time};
  Eigen::VectorXd spread;
  if (errors.can_weigh(data)) {
    spread = weigh(model, settled.fit, errors, {}, data);
  }
  until_settled(limits, settled.rounds > 0 ? summary_of(settled) : RoundSummary{}, [&](int) {
    if (settled.rounds > 0 && data.sigma.size() > 1) {
      data.sigma = scatter(model, without_samples(data, settled.verdict.outliers), settled.fit);
    }
    work.begin(fmt::format("searching, round {}", ++settled.rounds));
    settled.question = ask(model, data, settled.fit, repeats, settled.verdict.outliers, with_history, errors.of_inputs);
    settled.verdict = search(settled.question.evidence, settled.question.candidates, options.search);
    work.did(share_of_half_a_round * work.left());
    const TermData kept = without_samples(data, settled.verdict.outliers);
    std::vector<PlacedTerm> found = found_terms(settled.question, settled.verdict);
    hold(model, kept, settled.fit.parameters, found);
    settled.fit = fit_terms(model, kept, settled.fit.parameters, found);
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
      if (errors.can_weigh(data)) {
        const Eigen::VectorXd before = spread;
        spread = weigh(model, settled.fit, errors, settled.verdict.outliers, data);
        summary.may_be_last =
            summary.may_be_last && (spread - before).cwiseAbs().maxCoeff() <= same * before.maxCoeff();
      }
    }
    return summary;
  });
  return settled;
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
  Eigen::VectorXd sigma =
      weighted_rms(data.measured - means(model.predict(fit.parameters, fit.placed), data.samples), data);
  for (double& own : sigma) own = own > 0.0 ? own : 1.0;
  return sigma;
}

Settled search_terms(const TermModel& model, TermData& data, const std::vector<Eigen::Index>& repeats,
                     const TermFit& baseline, const KnownErrors& errors, const MissingOptions& options, Work& work) {
  Settled settled;
  settled.fit = baseline;
  settled = search_until_settled(model, data, repeats, std::move(settled), false, errors, options, work);
  if (data.stretches.empty() && std::ranges::any_of(model.terms(), &ModelTerm::history)) {
    TermData again = data;
    const Settled other = search_until_settled(model, again, repeats, settled, true, errors, options, work);
    if (needs_history(model, settled, other, options.search.rival_margin)) {
      data = again;
      settled = other;
    }
  }
  set_trial_errors(model, without_samples(data, settled.verdict.outliers), settled.fit);
  return settled;
}

}  // namespace llmt::discovery
