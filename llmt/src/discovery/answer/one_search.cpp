#include "discovery/answer/one_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "discovery/answer/errors_of_inputs.hpp"
#include "discovery/answer/findings.hpp"
#include "discovery/answer/judges.hpp"
#include "discovery/answer/question.hpp"
#include "discovery/recording/noise.hpp"
#include "discovery/recording/refuse.hpp"
#include "discovery/recording/row_split.hpp"
#include "llmt/discovery/rounds.hpp"
#include "llmt/discovery/search.hpp"
#include "llmt/statistics.hpp"

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
    if (retry_constants(model, kept, data, settled.fit)) {
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

namespace {

// Outputs count by their spread, because what the noise is of each is not known yet.
DistinctParameters determined(const TermModel& model, const TermData& data, const Eigen::VectorXd& start,
                              std::vector<Parameter>& parameters) {
  TermData by_spread = data;
  for (Eigen::Index o = 0; o < data.measured.cols(); ++o) {
    const double spread = spread_of(data.measured.col(o));
    if (spread > 0.0) by_spread.sigma(o) = spread;
  }
  return distinct_parameters(baseline_jacobian(model, by_spread, start, {}), parameters);
}

TermData data_of(const Samples& samples, const MeasuredOutputs& measured) {
  return {.samples = samples,
          .measured = means_of_filtered(measured.values, samples),
          .sigma = Eigen::VectorXd::Ones(measured.values.cols()),
          .stretches = {}};
}

// Time that counts as one independent value, from the deviations of the rows searched, the outputs together.
double correlation_time(const RowSplit& split, const Eigen::MatrixXd& deviations) {
  std::vector<Eigen::Index> stretches;
  for (Eigen::Index i = 0; i < split.searched.size(); ++i) {
    stretches.insert(stretches.end(), split.searched.rows_of(i).size(), split.stretches[i]);
  }
  double longest = 0.0;
  for (Eigen::Index o = 0; o < deviations.cols(); ++o) {
    const Eigen::VectorXd own = deviations.col(o)(split.searched.rows());
    longest = std::max(longest,
                       1.0 / independent_share(autocorrelation(own, stretches, std::vector<bool>(own.size(), true))));
  }
  return split.step * longest;
}

// Of the samples: the noise of an output, and what errors of the inputs do to the simulation.
void set_known_noise(const MeasuredOutputs& measured, const ErrorsOfInputs& errors, const RowSplit& split,
                     const TermData& data, Missing& missing) {
  if (measured.noise.size() == 0) return;
  for (std::size_t k = 0; k < missing.gaps.size(); ++k) {
    const auto o = static_cast<Eigen::Index>(k);
    const double noise = measured.noise(o) * measured.noise(o) / static_cast<double>(split.rows_per_sample);
    Eigen::VectorXd variances = Eigen::VectorXd::Constant(split.searched.size(), noise);
    if (data.known_variances) {
      variances = means_of_filtered(data.known_variances->col(o), split.searched);
    } else if (errors.noise) {
      variances += errors.noise->variances(split.searched).col(o);
    }
    missing.gaps[k].known_noise = std::sqrt(variances.cwiseProduct(weights_of(data, o).cwiseAbs2()).mean());
  }
}

}  // namespace

RowSplit split_of(const Recording& recording, const SearchedRows& searched, const MissingOptions& options) {
  const RowSplit split = recording.is_in_time() ? split_in_time(recording, options, searched.fewest_samples)
                                                : split_independent(recording.inputs(), options);
  const bool has_apart = std::ranges::find(searched.apart, true) != searched.apart.end();
  return has_apart ? without_rows(split, searched.apart) : split;
}

RowSplit split_of_all(const Recording& recording, const SearchedRows& searched, MissingOptions options) {
  options.held_out_share = 0.0;
  return split_of(recording, searched, options);
}

Missing search_once(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured,
                    const std::vector<ModelTerm>& terms, const SearchedRows& searched, const MissingOptions& options,
                    const std::set<std::size_t>& refuted) {
  const bool in_time = recording.is_in_time();
  Simulation distinct = simulation;
  TermModel model(distinct, recording, measured.names, terms, refuted);
  model.share(searched.columns, 0);
  const Eigen::VectorXd start = values_of(simulation.parameters);
  RowSplit split = split_of(recording, searched, options);
  ErrorsOfInputs errors = errors_of_inputs(model, measured, start, split);
  const Eigen::Index d = measured.values.cols();
  TermData data = data_of(split.searched, measured);
  data.stretches = split.stretches;
  const auto free = std::ranges::count_if(simulation.parameters, &Parameter::free);
  constexpr Eigen::Index fewest = 10;
  if (data.samples.size() * d < fewest + 2 * free) {
    refuse("find_missing",
           fmt::format("{} rows to search beside {} set aside are too few: {} free parameters need {} measured values",
                       split.searched.size(), split.held_out.size(), free, fewest + 2 * free));
  }
  Work work(options.progress);
  work.begin("fitting");
  const DistinctParameters sums = determined(model, data, start, distinct.parameters);
  TermFit baseline = fit_terms(model, data, start, {});
  data.sigma = scatter(model, data, baseline);
  if (d > 1) baseline = fit_terms(model, data, start, {});
  Settled settled =
      search_terms(model, data, split.repeats, baseline, {errors.noise.get(), measured.noise}, options, work);
  correct_estimates(errors, without_samples(data, settled.verdict.outliers), settled.fit);

  Missing missing;
  missing.verdict = settled.verdict;
  missing.rounds = settled.rounds;
  for (const PlacedTerm& option : settled.question.options) missing.candidates.push_back(option_label(model, option));
  describe_findings(model, settled, missing);
  describe_limits(settled, data, missing);
  missing.parameters = distinct.parameters;
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) {
    missing.parameters[k].value = settled.fit.parameters(k);
  }
  missing.standard_errors = settled.fit.parameter_errors;
  missing.searched = split.searched.rows();
  missing.held_out = split.held_out.rows();
  for (Eigen::Index i = 0; i < split.held_out.size(); ++i) {
    missing.held_out_samples.insert(missing.held_out_samples.end(), split.held_out.rows_of(i).size(), i);
  }
  for (const std::size_t sample : settled.verdict.outliers) {
    for (const Eigen::Index row : split.searched.rows_of(sample)) missing.outliers.push_back(row);
  }
  const TermData kept = without_samples(data, settled.verdict.outliers);
  if (!settled.verdict.outliers.empty()) baseline = fit_terms(model, kept, start, {});
  const Eigen::MatrixXd nominal = recording.as_measured(model.predict(start, {}));
  missing.before = recording.as_measured(model.predict(baseline.parameters, {}));
  missing.corrected = recording.as_measured(model.predict(settled.fit.parameters, settled.fit.placed));
  missing.structure = structure_beside(model, kept, recording.inputs(), errors.deviations, missing);
  // Independent rows with errors of the inputs deviate like their neighbours: the errors alone do that.
  if (errors.noise && !in_time) missing.structure.clear();
  TermData aside = data_of(split.held_out, measured);
  aside.sigma = data.sigma;
  aside.weights = data.weights;
  missing.weights = data.weights ? *data.weights : Eigen::MatrixXd();
  judge_held_out(model, kept, aside, baseline, settled, in_time ? errors.noise.get() : nullptr, missing);
  if (in_time) find_states_of_outputs(recording, measured, missing);
  missing.notes.insert(missing.notes.end(), errors.notes.begin(), errors.notes.end());
  judge_findings(missing, in_time);
  doubt_uncorrected(errors, missing);
  describe_parameters({model, kept, start, baseline, settled.fit}, sums, options.search.false_alarm_rate, missing);
  missing.floor_from_repeats = settled.verdict.lack_of_fit.has_enough_repeats();
  const double noise = missing.floor_from_repeats ? settled.verdict.lack_of_fit.noise : settled.verdict.noise;
  for (Eigen::Index o = 0; o < d; ++o) {
    const Eigen::VectorXd before = measured.values.col(o) - missing.before.col(o);
    const Eigen::VectorXd after = measured.values.col(o) - missing.corrected.col(o);
    const auto aside_of = [&](const Eigen::VectorXd& rows) -> Eigen::VectorXd {
      return means_of_filtered(rows, split.held_out).cwiseProduct(weights_of(aside, o));
    };
    missing.gaps.push_back(gap_of(measured.names[o], aside_of(measured.values.col(o) - nominal.col(o)),
                                  aside_of(before), aside_of(after), noise * data.sigma(o)));
  }
  set_known_noise(measured, errors, split, data, missing);
  judge_noise(missing);
  if (in_time) {
    missing.time = {.in_time = true,
                    .found_out = false,
                    .rows_per_sample = split.rows_per_sample,
                    .samples = split.searched.size(),
                    .step = split.step,
                    .independent_share = data.independent_share,
                    .correlation_time = correlation_time(split, measured.values - missing.corrected)};
  }
  decide(missing);
  if (missing.answer == Answer::nothing_missing && is_drift(missing)) {
    object(missing, Reason::drift);
    decide(missing);
    missing.visible.clear();  // beside a drift no term could be seen
    missing.notes.emplace_back(
        "what is left may be a drift, a term that was not tried, or one that varies as slowly: record longer, or with "
        "more changes of the inputs");
  }
  if (missing.answer != Answer::failed_held_out && is_worse(missing)) {
    missing.notes.emplace_back(
        missing.answer == Answer::inner_state
            ? "with signals as noisy as these the correction is worse than none, and is not written: the terms make "
              "errors of the inputs larger, by more than they explain on the rows set aside"
            : "the correction makes the error on the rows set aside larger, and is not written");
  }
  work.finish();
  return missing;
}

}  // namespace llmt::discovery
