#include "llmt/discovery/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "discovery/terms/fitted_parameters.hpp"
#include "discovery/terms/missing_findings.hpp"
#include "discovery/terms/refuse.hpp"
#include "discovery/terms/term_question.hpp"
#include "llmt/discovery/rounds.hpp"
#include "llmt/statistics.hpp"

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
  const Eigen::MatrixXd predicted = model.predict(fit.parameters, fit.placed);
  Eigen::VectorXd sigma(data.measured.cols());
  for (Eigen::Index o = 0; o < sigma.size(); ++o) {
    const Eigen::VectorXd left = data.measured.col(o) - predicted.col(o)(data.rows);
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

// The weights of the outputs follow what each round leaves of them.
Settled search_until_settled(const TermModel& model, TermData& data, const std::vector<Eigen::Index>& repeats,
                             const TermFit& baseline, const MissingOptions& options, Work& work) {
  Settled settled;
  settled.fit = baseline;
  until_settled({.most = options.rounds}, {}, [&](int round) {
    if (round > 0 && data.sigma.size() > 1) {
      data.sigma = scatter(model, without_samples(data, settled.verdict.outliers), settled.fit);
    }
    work.begin(fmt::format("searching, round {}", ++settled.rounds));
    settled.question = ask(model, data, settled.fit, repeats, settled.verdict.outliers);
    settled.verdict = search(settled.question.evidence, settled.question.candidates, options.search);
    work.did(share_of_half_a_round * work.left());
    const TermData kept = without_samples(data, settled.verdict.outliers);
    settled.fit = fit_terms(model, kept, settled.fit.parameters, found_terms(settled.question, settled.verdict));
    if (retry_constants(model, kept, settled.fit)) {
      settled.fit = fit_terms(model, kept, settled.fit.parameters, settled.fit.placed);
    }
    work.did(share_of_half_a_round * work.left());
    return summary_of(settled);
  });
  set_trial_errors(model, without_samples(data, settled.verdict.outliers), settled.fit);
  return settled;
}

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

double rms_at(const Eigen::VectorXd& errors, const std::vector<Eigen::Index>& rows) {
  if (rows.empty()) return unknown_number;
  return std::sqrt(errors(rows).squaredNorm() / static_cast<double>(rows.size()));
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

Missing find_missing(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
                     const std::vector<ModelTerm>& terms, const MissingOptions& options) {
  check(simulation, inputs, measured, options);
  Simulation distinct = simulation;
  const TermModel model(distinct, inputs, measured.names, terms);
  const RowSplit split = split_rows(inputs, options);
  const Eigen::Index d = measured.values.cols();
  TermData data{split.searched, measured.values(split.searched, Eigen::all), Eigen::VectorXd::Ones(d)};
  const auto free = std::ranges::count_if(simulation.parameters, &Parameter::free);
  constexpr Eigen::Index fewest = 10;
  if (std::ssize(data.rows) * d < fewest + 2 * free) {
    refuse("find_missing",
           fmt::format("{} rows to search beside {} set aside are too few: {} free parameters need {} measured values",
                       data.rows.size(), split.held_out.size(), free, fewest + 2 * free));
  }
  Eigen::VectorXd start(std::ssize(simulation.parameters));
  for (std::size_t k = 0; k < simulation.parameters.size(); ++k) start(k) = simulation.parameters[k].value;
  Work work(options.progress);
  work.begin("fitting");
  const DistinctParameters sums = determined(model, data, start, distinct.parameters);
  TermFit baseline = fit_terms(model, data, start, {});
  data.sigma = scatter(model, data, baseline);
  if (d > 1) baseline = fit_terms(model, data, start, {});
  const Settled settled = search_until_settled(model, data, split.repeats, baseline, options, work);

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
  missing.searched = split.searched;
  missing.held_out = split.held_out;
  for (const std::size_t sample : settled.verdict.outliers) missing.outliers.push_back(split.searched[sample]);
  if (!settled.verdict.outliers.empty()) {
    baseline = fit_terms(model, without_samples(data, settled.verdict.outliers), start, {});
  }
  const Eigen::MatrixXd nominal = model.predict(start, {});
  missing.before = model.predict(baseline.parameters, {});
  missing.corrected = model.predict(settled.fit.parameters, settled.fit.placed);
  missing.structure = structure_beside(model, without_samples(data, settled.verdict.outliers), inputs, missing);
  decide(missing);
  describe_parameters({model, without_samples(data, settled.verdict.outliers), start, baseline, settled.fit}, sums,
                      options.search.false_alarm_rate, missing);
  missing.floor_from_repeats = settled.verdict.lack_of_fit.has_enough_repeats();
  const double noise = missing.floor_from_repeats ? settled.verdict.lack_of_fit.noise : settled.verdict.noise;
  for (Eigen::Index o = 0; o < d; ++o) {
    missing.gaps.push_back({measured.names[o], rms_at(measured.values.col(o) - missing.before.col(o), split.held_out),
                            rms_at(measured.values.col(o) - missing.corrected.col(o), split.held_out),
                            noise * data.sigma(o), rms_at(measured.values.col(o) - nominal.col(o), split.held_out)});
  }
  work.finish();
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
