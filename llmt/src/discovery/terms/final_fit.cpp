#include "discovery/terms/final_fit.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "discovery/recording/row_filter.hpp"
#include "discovery/recording/row_split.hpp"
#include "discovery/recording/standstill.hpp"
#include "discovery/terms/errors_of_inputs.hpp"
#include "discovery/terms/fitted_parameters.hpp"
#include "discovery/terms/groups.hpp"
#include "discovery/terms/missing_findings.hpp"
#include "discovery/terms/outliers.hpp"
#include "discovery/terms/term_question.hpp"
#include "discovery/terms/term_rounds.hpp"

namespace llmt::discovery {
namespace {

// Sums keep the parts that the search has found.
void move_parameters(const TermFit& fit, const TermFit& alone, double false_alarm_rate, Missing& missing) {
  for (FittedParameter& fitted : missing.fitted_parameters) {
    const auto first = std::ranges::find(missing.parameters, fitted.parts.front(), &Parameter::name);
    const auto k = first - missing.parameters.begin();
    const double nominal = first->value - fitted.change;
    fitted.change = fit.parameters(k) - nominal;
    fitted.alone = alone.parameters(k) - nominal;
    fitted.standard_error = fit.parameter_errors(k);
    fitted.changed = is_beyond_chance(fitted, false_alarm_rate);
  }
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) missing.parameters[k].value = fit.parameters(k);
  missing.standard_errors = fit.parameter_errors;
}

RowSplit with_samples(const RowSplit& split, const std::vector<bool>& kept) {
  RowSplit some = split;
  some.searched = {};
  some.stretches.clear();
  some.repeats.clear();
  for (Eigen::Index i = 0; i < split.searched.size(); ++i) {
    if (!kept[i]) continue;
    some.searched.add(split.searched, i);
    if (!split.stretches.empty()) some.stretches.push_back(split.stretches[i]);
    if (!split.repeats.empty()) some.repeats.push_back(split.repeats[i]);
  }
  return some;
}

// Without the outliers of the search and the samples that are more than 5 noise floors off, as those set aside are
// judged. None where they are many: then the rows set aside do not agree with what was found.
std::optional<RowSplit> without_outliers(const TermModel& model, const MeasuredOutputs& measured,
                                         const Missing& missing, const Eigen::VectorXd& parameters,
                                         const std::vector<PlacedTerm>& placed, const RowSplit& split) {
  Eigen::MatrixXd left =
      (means_of_filtered(measured.values, split.searched) - means(model.predict(parameters, placed), split.searched))
          .cwiseAbs();
  if (missing.weights.size() > 0) left.array() *= means_of_filtered(missing.weights, split.searched).array();
  const std::set<Eigen::Index> outliers(missing.outliers.begin(), missing.outliers.end());
  std::vector<bool> kept(left.rows(), true);
  for (Eigen::Index i = 0; i < left.rows(); ++i) {
    for (std::size_t o = 0; o < missing.gaps.size(); ++o) {
      if (left(i, static_cast<Eigen::Index>(o)) > far_off * missing.gaps[o].noise_floor) kept[i] = false;
    }
  }
  if (static_cast<double>(std::ranges::count(kept, false)) >
      largest_share_of_outliers * static_cast<double>(left.rows())) {
    return std::nullopt;
  }
  for (Eigen::Index i = 0; i < left.rows(); ++i) {
    if (outliers.contains(split.searched.rows_of(i).front())) kept[i] = false;
  }
  return with_samples(split, kept);
}

}  // namespace

void fit_on_all_rows(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured,
                     const std::vector<ModelTerm>& terms, const SearchedRows& rows, const MissingOptions& options,
                     Missing& missing) {
  if (missing.held_out.empty() || missing.answer == Answer::failed_held_out) return;
  Simulation distinct = simulation;
  distinct.parameters = missing.parameters;
  TermModel model(distinct, recording, measured.names, terms);
  model.share(rows.columns, 0);
  const Eigen::VectorXd start = values_of(missing.parameters);
  MissingOptions nothing_aside = options;
  nothing_aside.held_out_share = 0.0;
  RowSplit split = split_of(recording, rows, nothing_aside);
  std::vector<PlacedTerm> placed = placed_terms(missing);
  const std::optional<RowSplit> fitting = without_outliers(model, measured, missing, start, placed, split);
  if (!fitting) return;
  split = *fitting;
  ErrorsOfInputs errors = errors_of_inputs(model, measured, start, split);
  TermData data{.samples = split.searched,
                .measured = means_of_filtered(measured.values, split.searched),
                .sigma = Eigen::VectorXd::Ones(measured.values.cols()),
                .stretches = split.stretches,
                .independent_share = missing.time.independent_share};
  const KnownErrors known{errors.noise.get(), measured.noise};
  if (known.can_weigh(data)) weigh(model, {start, {}, placed, {}}, known, {}, data);
  data.sigma = scatter(model, data, {start, {}, placed, {}});
  hold(model, data, start, placed);
  TermFit fit = fit_terms(model, data, start, placed);
  if (retry_constants(model, data, fit)) fit = fit_terms(model, data, fit.parameters, fit.placed);
  const TermFit alone = fit_terms(model, data, start, {});
  set_trial_errors(model, data, fit);
  const bool is_certain = missing.answer == Answer::named || missing.answer == Answer::indistinguishable;
  if (recording.is_in_time() && is_certain) name_groups(model, data, fit, missing);
  correct_estimates(errors, data, fit);
  for (std::size_t k = 0; k < missing.found.size(); ++k) set_estimates(fit.placed[k], fit.errors[k], missing.found[k]);
  move_parameters(fit, alone, options.search.false_alarm_rate, missing);
  missing.before = recording.as_measured(model.predict(alone.parameters, {}));
  missing.corrected = recording.as_measured(model.predict(fit.parameters, fit.placed));
}

}  // namespace llmt::discovery
