#include "discovery/terms/one_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "discovery/recording/noise.hpp"
#include "discovery/recording/refuse.hpp"
#include "discovery/recording/row_filter.hpp"
#include "discovery/recording/row_split.hpp"
#include "discovery/recording/standstill.hpp"
#include "discovery/terms/decision.hpp"
#include "discovery/terms/errors_of_inputs.hpp"
#include "discovery/terms/fitted_parameters.hpp"
#include "discovery/terms/held_out.hpp"
#include "discovery/terms/missing_findings.hpp"
#include "discovery/terms/term_question.hpp"
#include "discovery/terms/term_rounds.hpp"
#include "llmt/statistics.hpp"

namespace llmt::discovery {
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
