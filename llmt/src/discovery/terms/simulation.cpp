#include "llmt/discovery/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "discovery/terms/correlation.hpp"
#include "discovery/terms/errors_of_inputs.hpp"
#include "discovery/terms/held_out.hpp"
#include "discovery/terms/missing_findings.hpp"
#include "discovery/terms/refuse.hpp"
#include "discovery/terms/row_split.hpp"
#include "discovery/terms/term_question.hpp"
#include "llmt/discovery/rounds.hpp"

namespace llmt::discovery {
namespace {

// A search, and the fit after it, count as this share of the work that is left: the number of rounds is not known.
constexpr double share_of_half_a_round = 0.2;

constexpr double unknown_number = std::numeric_limits<double>::quiet_NaN();

void check(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
           const MissingOptions& options) {
  const Eigen::Index n = inputs.values.rows();
  if (!simulation.predict) refuse("find_missing", "the simulation has no function predict");
  if (measured.values.rows() != n) {
    refuse("find_missing", fmt::format("{} rows of measured outputs for {} rows of inputs", measured.values.rows(), n));
  }
  if (measured.names.empty() || std::ssize(measured.names) != measured.values.cols()) {
    refuse("find_missing",
           fmt::format("{} names for {} measured outputs", measured.names.size(), measured.values.cols()));
  }
  for (Eigen::Index o = 0; o < measured.values.cols(); ++o) {
    if (!measured.values.col(o).allFinite()) {
      refuse("find_missing", fmt::format("a measured value of \"{}\" is not finite", measured.names[o]));
    }
  }
  if (!(options.held_out_share >= 0.0 && options.held_out_share <= 0.9)) {
    refuse("find_missing", fmt::format("held_out_share is {}, must be within 0 ... 0.9", options.held_out_share));
  }
  if (options.rounds < 1) refuse("find_missing", fmt::format("rounds is {}, must be at least 1", options.rounds));
  constexpr Eigen::Index fewest = 50;
  if (options.largest_sample < fewest) {
    refuse("find_missing", fmt::format("largest_sample is {}, must be at least {}", options.largest_sample, fewest));
  }
}

// Root mean square of what is left of each output, in its own unit.
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

// Whether terms that depend on earlier rows explain better than what rows explain by themselves.
bool needs_history(const TermModel& model, const Settled& plain, const Settled& with_history, double margin) {
  const bool has_history = std::ranges::any_of(
      with_history.fit.placed, [&](const PlacedTerm& placed) { return model.terms()[placed.term].history; });
  if (!has_history) return false;
  const bool names_more = plain.verdict.answer == Answer::unknown && with_history.verdict.answer != Answer::unknown;
  return names_more || with_history.verdict.score_gain > plain.verdict.score_gain + margin;
}

// The terms of rows by themselves first, then those that depend on earlier rows beside them.
Settled search_terms(const TermModel& model, TermData& data, const std::vector<Eigen::Index>& repeats,
                     const TermFit& baseline, const InputNoise* noise, const MissingOptions& options, Work& work) {
  Settled settled;
  settled.fit = baseline;
  settled = search_until_settled(model, data, repeats, std::move(settled), false, noise, options, work);
  if (std::ranges::any_of(model.terms(), &ModelTerm::history)) {
    TermData again = data;
    const Settled other = search_until_settled(model, again, repeats, settled, true, noise, options, work);
    if (needs_history(model, settled, other, options.search.rival_margin)) {
      data = again;
      settled = other;
    }
  }
  set_trial_errors(model, without_samples(data, settled.verdict.outliers), settled.fit);
  return settled;
}

double rms_at(const Eigen::VectorXd& errors, const Samples& samples) {
  if (samples.size() == 0) return unknown_number;
  return std::sqrt(means(errors, samples).squaredNorm() / static_cast<double>(samples.size()));
}

}  // namespace

Simulation tabulated(const Eigen::MatrixXd& simulated, const std::vector<std::string>& outputs, bool offset,
                     bool scale) {
  if (std::ssize(outputs) != simulated.cols()) {
    throw std::invalid_argument(
        fmt::format("llmt::discovery::tabulated: {} names for {} columns", outputs.size(), simulated.cols()));
  }
  Simulation simulation;
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    const auto column = simulated.col(o);
    const double spread = column.size() > 0 ? column.maxCoeff() - column.minCoeff() : 0.0;
    simulation.parameters.push_back({.name = outputs[o] + ".offset",
                                     .unit = outputs[o],
                                     .value = 0.0,
                                     .scale = spread > 0.0 ? 0.01 * spread : 1.0,
                                     .free = offset});
    simulation.parameters.push_back(
        {.name = outputs[o] + ".scale", .unit = "1", .value = 1.0, .scale = 0.01, .free = scale});
  }
  simulation.predict = [simulated](const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values) {
    if (inputs.rows() != simulated.rows()) {
      throw std::invalid_argument(
          fmt::format("a tabulated simulation has {} rows, not {}", simulated.rows(), inputs.rows()));
    }
    Eigen::MatrixXd predicted = simulated;
    for (Eigen::Index o = 0; o < simulated.cols(); ++o) {
      predicted.col(o) = (values(2 * o) + values(2 * o + 1) * simulated.col(o).array()).matrix();
    }
    return predicted;
  };
  return simulation;
}

namespace {

TermData data_of(const Samples& samples, const MeasuredOutputs& measured) {
  return {.samples = samples,
          .measured = means(measured.values, samples),
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

Missing find(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
             const std::vector<ModelTerm>& terms, const MissingOptions& options) {
  const bool in_time = inputs.instants.size() > 0;
  const TermModel model(simulation, inputs, measured.names, terms);
  Eigen::VectorXd start(std::ssize(simulation.parameters));
  for (std::size_t k = 0; k < simulation.parameters.size(); ++k) start(k) = simulation.parameters[k].value;
  RowSplit split = in_time ? split_in_time(inputs, options) : split_independent(inputs, options);
  ErrorsOfInputs errors = errors_of_inputs(model, inputs, measured, start, split);
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
  TermFit baseline = fit_terms(model, data, start, {});
  data.sigma = scatter(model, data, baseline);
  if (d > 1) baseline = fit_terms(model, data, start, {});
  Settled settled = search_terms(model, data, split.repeats, baseline, errors.noise.get(), options, work);
  correct_estimates(errors, without_samples(data, settled.verdict.outliers), settled.fit);

  Missing missing;
  missing.verdict = settled.verdict;
  missing.rounds = settled.rounds;
  for (const PlacedTerm& option : settled.question.options) missing.candidates.push_back(option_label(model, option));
  describe_findings(model, settled, missing);
  describe_limits(settled, data, missing);
  missing.parameters = simulation.parameters;
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) {
    missing.parameters[k].value = settled.fit.parameters(k);
  }
  missing.standard_errors = settled.fit.parameter_errors;
  missing.searched = split.searched.rows();
  missing.held_out = split.held_out.rows();
  for (const std::size_t sample : settled.verdict.outliers) {
    for (const Eigen::Index row : split.searched.rows_of(sample)) missing.outliers.push_back(row);
  }
  const TermData kept = without_samples(data, settled.verdict.outliers);
  if (!settled.verdict.outliers.empty()) baseline = fit_terms(model, kept, start, {});
  missing.before = model.predict(baseline.parameters, {});
  missing.corrected = model.predict(settled.fit.parameters, settled.fit.placed);
  missing.structure = structure_beside(model, kept, inputs, missing);
  // Independent rows with errors of the inputs deviate like their neighbours: the errors alone do that.
  if (errors.noise && !in_time) missing.structure.clear();
  TermData aside = data_of(split.held_out, measured);
  aside.sigma = data.sigma;
  judge_held_out(model, kept, aside, baseline, settled, missing);
  missing.notes.insert(missing.notes.end(), errors.notes.begin(), errors.notes.end());
  decide(missing);
  doubt_uncorrected(errors, missing);
  missing.floor_from_repeats = settled.verdict.lack_of_fit.has_enough_repeats();
  const double noise = missing.floor_from_repeats ? settled.verdict.lack_of_fit.noise : settled.verdict.noise;
  for (Eigen::Index o = 0; o < d; ++o) {
    missing.gaps.push_back({measured.names[o], rms_at(measured.values.col(o) - missing.before.col(o), split.held_out),
                            rms_at(measured.values.col(o) - missing.corrected.col(o), split.held_out),
                            noise * data.sigma(o)});
  }
  if (in_time) {
    missing.time = {.in_time = true,
                    .found_out = false,
                    .rows_per_sample = split.rows_per_sample,
                    .samples = split.searched.size(),
                    .step = split.step,
                    .independent_share = data.independent_share,
                    .correlation_time = correlation_time(split, measured.values - missing.corrected)};
  }
  work.finish();
  return missing;
}

// Whether rows follow each other in time although nobody said so: the inputs are smooth along them, and what is left
// is alike in neighbours.
bool follow_in_time(const Inputs& inputs, const MeasuredOutputs& measured, const Missing& missing) {
  constexpr Eigen::Index fewest = 100;
  constexpr double alike = 0.6;  // independent share
  const Eigen::Index n = inputs.values.rows();
  if (!inputs.order.empty() || n < fewest || !is_smooth_along_rows(inputs)) return false;
  const std::vector<Eigen::Index> one_stretch(n, 0);
  std::vector<bool> used(n, true);
  for (const Eigen::Index row : missing.outliers) used[row] = false;
  for (Eigen::Index o = 0; o < measured.values.cols(); ++o) {
    const Eigen::VectorXd left = measured.values.col(o) - missing.corrected.col(o);
    if (independent_share(autocorrelation(left, one_stretch, used)) < alike) return true;
  }
  return false;
}

}  // namespace

Missing find_missing(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
                     const std::vector<ModelTerm>& terms, const MissingOptions& options) {
  check(simulation, inputs, measured, options);
  Missing missing = find(simulation, inputs, measured, terms, options);
  if (inputs.instants.size() > 0 || !follow_in_time(inputs, measured, missing)) return missing;
  Inputs in_time = inputs;
  in_time.instants =
      Eigen::VectorXd::LinSpaced(inputs.values.rows(), 0.0, static_cast<double>(inputs.values.rows() - 1));
  missing = find(simulation, in_time, measured, terms, options);
  missing.time.found_out = true;
  return missing;
}

Eigen::MatrixXd corrected(const Simulation& simulation, const Missing& missing, const std::vector<ModelTerm>& terms,
                          const Inputs& inputs) {
  std::vector<std::string> outputs;
  for (const Gap& gap : missing.gaps) outputs.push_back(gap.output);
  const TermModel model(simulation, inputs, outputs, terms);
  Eigen::VectorXd values(std::ssize(missing.parameters));
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) values(k) = missing.parameters[k].value;
  std::vector<PlacedTerm> placed;
  for (const FoundTerm& found : missing.found) {
    placed.push_back({found.term, found.output_index, found.constants, found.coefficients, 0.0});
  }
  return model.predict(values, placed);
}

}  // namespace llmt::discovery
