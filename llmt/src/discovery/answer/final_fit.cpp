// Estimates of an answer that stands, from all rows, and the terms that are the same function there.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "discovery/answer/contests.hpp"
#include "discovery/answer/errors_of_inputs.hpp"
#include "discovery/answer/findings.hpp"
#include "discovery/answer/judges.hpp"
#include "discovery/answer/one_search.hpp"
#include "discovery/answer/question.hpp"
#include "discovery/recording/row_split.hpp"
#include "discovery/search/workspace.hpp"

namespace llmt::discovery {
namespace {

constexpr double rank_tolerance = 1e-9;

// What a term explains of the residuals beyond the nuisance, and what is left then.
struct InPlace {
  PlacedTerm placed;
  Eigen::VectorXd function;
  double left = 0.0;
  double numbers = 0.0;
};

class Ground {
 public:
  explicit Ground(TrialGround ground)
      : basis_(range_basis(ground.nuisance, rank_tolerance)), ground_(std::move(ground)) {
    residuals_ = ground_.residuals - basis_ * (basis_.transpose() * ground_.residuals);
  }

  const TrialGround& ground() const { return ground_; }

  InPlace with(const TermModel& model, const TermData& data, PlacedTerm placed,
               const Eigen::MatrixXd& simulated) const {
    Eigen::MatrixXd columns = stacked_signature(model, data, placed, simulated);
    const Eigen::RowVectorXd norms = columns.colwise().norm();
    columns -= basis_ * (basis_.transpose() * columns);
    for (Eigen::Index c = 0; c < columns.cols(); ++c) {
      if (columns.col(c).norm() < absorbed_share * norms(c)) columns.col(c).setZero();
    }
    const Eigen::MatrixXd range = range_basis(columns, rank_tolerance);
    const auto numbers = static_cast<double>(range.cols() + placed.constants.size());
    Eigen::VectorXd function = range * (range.transpose() * residuals_);
    const double left = (residuals_ - function).squaredNorm();
    return {std::move(placed), std::move(function), left, numbers};
  }

 private:
  Eigen::MatrixXd basis_;
  TrialGround ground_;
  Eigen::VectorXd residuals_;
};

bool may_have_another(const ModelTerm& term) {
  return !term.generic && !term.history && !term.whole && term.inner_state.empty();
}

// Of terms that act in a regime only those of the same one are rivals, beyond the same threshold.
bool may_stand_for(const ModelTerm& other, const ModelTerm& term) {
  return may_have_another(other) && other.regime == term.regime && gate_of(other.location) == gate_of(term.location);
}

// The term at the constants that explain most in the place of one that was found.
std::vector<PlacedTerm> options_of(const TermModel& model, const TermData& data, const TrialGround& ground,
                                   std::size_t term, const PlacedTerm& found, const Eigen::MatrixXd& simulated) {
  const ModelTerm& own = model.terms()[term];
  const bool is_everywhere = own.regime.empty();
  const Eigen::Index last = found.constants.size() - 1;
  if (std::ssize(own.constants) > (is_everywhere ? 0 : 1)) {
    const std::optional<double> threshold = is_everywhere ? std::nullopt : std::optional<double>(found.constants(last));
    return best_constants(model, data, ground, term, found.output, simulated, {}, threshold);
  }
  const Eigen::VectorXd constants = is_everywhere ? Eigen::VectorXd() : found.constants.tail(1);
  return {{term, found.output, constants, Eigen::VectorXd::Zero(std::ssize(own.coefficients)), 0.0}};
}

std::string name_of(const ModelTerm& term) {
  return term.location.empty() ? term.family : term.family + " " + term.location;
}

// "x = 0.3, dx = -1.2", of the inputs of both terms.
std::string where(const TermModel& model, const ModelTerm& own, const ModelTerm& other, Eigen::Index row) {
  std::vector<std::string> inputs = own.inputs;
  for (const std::string& name : other.inputs) {
    if (std::ranges::find(inputs, name) == inputs.end()) inputs.push_back(name);
  }
  std::string text;
  for (const std::string& name : inputs) {
    text += fmt::format("{}{} = {:.3g}", text.empty() ? "" : ", ", name, model.input(name)(row));
  }
  return text;
}

// The likeliest of the members that are not named yet; of many the others say no more.
void add_rivals(std::vector<std::pair<double, RivalTerms>> members, FoundTerm& found) {
  constexpr std::size_t most = 8;
  std::ranges::stable_sort(members, {}, &std::pair<double, RivalTerms>::first);
  for (auto& [evidence, member] : members) {
    const auto is_named = [&name = member.what](const RivalTerms& rival) {
      return rival.what == name || rival.what.starts_with(name + " (");  // with its constant
    };
    if (found.rivals.size() >= most) break;
    if (std::ranges::none_of(found.rivals, is_named)) found.rivals.push_back(std::move(member));
  }
}

}  // namespace

void name_groups(const TermModel& model, const TermData& data, const TermFit& fit, Missing& missing) {
  constexpr double likelihood_margin = 3.0;  // e^3, 20 times as likely
  constexpr double hardly = 0.02;
  const Eigen::MatrixXd simulated = model.simulated(fit.parameters);
  const double samples = data.independent_share * static_cast<double>(data.samples.size());
  for (std::size_t k = 0; k < fit.placed.size(); ++k) {
    const ModelTerm& own_term = model.terms()[fit.placed[k].term];
    if (!may_have_another(own_term)) continue;
    const Ground place(ground_without(model, data, fit, k));
    const InPlace own = place.with(model, data, fit.placed[k], simulated);
    FoundTerm& found = missing.found[k];
    const Eigen::Index output = fit.placed[k].output;
    std::vector<std::pair<double, RivalTerms>> members;  // with the evidence against each
    double farthest = same_function;
    std::optional<InPlace> differing;
    for (std::size_t t = 0; t < model.terms().size(); ++t) {
      const ModelTerm& term = model.terms()[t];
      if (t == fit.placed[k].term || !may_stand_for(term, own_term)) continue;
      if (!term.output.empty() && term.output != model.outputs()[output]) continue;
      for (PlacedTerm& option : options_of(model, data, place.ground(), t, fit.placed[k], simulated)) {
        const InPlace other = place.with(model, data, std::move(option), simulated);
        const double evidence =
            0.5 * samples * std::log(other.left / own.left) + 0.5 * (other.numbers - own.numbers) * std::log(samples);
        const double difference = (other.function - own.function).norm() / own.function.norm();
        // Of functions that differ by so little, rows whose signals were filtered cannot tell which one it is.
        const bool is_same = difference < hardly;
        const bool contains_it = other.numbers > own.numbers && is_same;
        if (!(evidence <= likelihood_margin || is_same) || contains_it) continue;
        members.push_back({evidence, {.what = name_of(term), .inputs = term.inputs, .exact = false}});
        if (difference > farthest) {
          farthest = difference;
          differing = other;
        }
      }
    }
    add_rivals(std::move(members), found);
    if (!differing) continue;
    Eigen::Index place_of_most = 0;
    (differing->function - own.function).cwiseAbs().maxCoeff(&place_of_most);
    const Eigen::Index row = data.samples.rows_of(place_of_most / data.measured.cols()).front();
    const ModelTerm& other = model.terms()[differing->placed.term];
    missing.notes.push_back(fmt::format(
        "{} is tentative: {} explains these rows as well and differs from it by {:.0f} % of what it adds, most at {}; "
        "rows like that one tell them apart",
        name_of(own_term), name_of(other), 100.0 * farthest, where(model, own_term, other, row)));
    object(missing, Reason::rival, {k});
  }
  decide(missing);
}

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
  RowSplit split = split_of_all(recording, rows, options);
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
  if (retry_constants(model, data, data, fit)) fit = fit_terms(model, data, fit.parameters, fit.placed);
  const TermFit alone = fit_terms(model, data, start, {});
  place_thresholds_at_rest(model, measured, rows, missing, static_cast<double>(data.samples.size()), fit);
  set_trial_errors(model, data, fit);
  const bool has_names = missing.answer == Answer::named || missing.answer == Answer::indistinguishable ||
                         missing.answer == Answer::undecided;
  if (recording.is_in_time() && has_names) name_groups(model, data, fit, missing);
  correct_estimates(errors, data, fit);
  for (std::size_t k = 0; k < missing.found.size(); ++k) set_estimates(fit.placed[k], fit.errors[k], missing.found[k]);
  move_parameters(fit, alone, options.search.false_alarm_rate, missing);
  missing.before = recording.as_measured(model.predict(alone.parameters, {}));
  missing.corrected = recording.as_measured(model.predict(fit.parameters, fit.placed));
}

}  // namespace llmt::discovery
