#include "discovery/terms/term_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "discovery/recording/refuse.hpp"
#include "discovery/recording/row_split.hpp"
#include "llmt/discovery/least_squares.hpp"

namespace llmt::discovery {

ColumnCache::ColumnCache(const Recording& recording) : places_(recording.inputs().values.rows(), -1) {
  MissingOptions nothing_aside;
  nothing_aside.held_out_share = 0.0;
  all_ = split_in_time(recording, nothing_aside, 1).searched;
  for (Eigen::Index i = 0; i < all_.size(); ++i) places_[all_.rows()[i]] = i;
}

namespace {

bool is_of_inputs_alone(const ModelTerm& term) {
  return !term.inputs.empty() && !term.code.empty() && term.inner_state.empty() &&
         std::ranges::none_of(term.code, [](const std::string& code) { return code.find("$s") != std::string::npos; });
}

}  // namespace

bool ColumnCache::holds(const ModelTerm& term) { return term.constants.empty() && is_of_inputs_alone(term); }

bool ColumnCache::is_state_of_inputs(const ModelTerm& term) {
  return !term.constants.empty() && !term.inner_state.empty() && !term.inputs.empty();
}

bool ColumnCache::holds_grid(const ModelTerm& term) {
  return (!term.constants.empty() && is_of_inputs_alone(term)) || is_state_of_inputs(term);
}

Eigen::MatrixXd ColumnCache::of_samples(const Eigen::MatrixXd& all, const Samples& samples) const {
  std::vector<Eigen::Index> places(samples.size());
  for (Eigen::Index i = 0; i < samples.size(); ++i) places[i] = places_[samples.rows_of(i).front()];
  return all(places, Eigen::all);
}

Eigen::MatrixXd ColumnCache::at(const Samples& samples, std::size_t draw, std::size_t term,
                                const std::function<Eigen::MatrixXd()>& columns) {
  const auto [place, is_new] = columns_.try_emplace({draw, term});
  if (is_new) place->second = means(columns(), all_);
  return of_samples(place->second, samples);
}

Eigen::MatrixXd ColumnCache::grid_at(const Samples& samples, std::size_t term,
                                     const std::vector<Eigen::VectorXd>& tried,
                                     const std::function<Eigen::MatrixXd(const Samples&)>& columns) {
  std::vector<double> values;
  for (const Eigen::VectorXd& constants : tried) values.insert(values.end(), constants.begin(), constants.end());
  const auto [place, is_new] = grids_.try_emplace({term, std::move(values)});
  if (is_new) place->second = columns(all_);
  return of_samples(place->second, samples);
}

Eigen::Index first_bad_row(const Eigen::MatrixXd& values) {
  Eigen::Index row = 0;
  while (row < values.rows() && values.row(row).allFinite()) ++row;
  return row;
}

TermModel::TermModel(const Simulation& simulation, const Recording& recording, std::vector<std::string> outputs,
                     const std::vector<ModelTerm>& terms, std::set<std::size_t> refuted)
    : simulation_(&simulation),
      recording_(&recording),
      outputs_(std::move(outputs)),
      terms_(&terms),
      refuted_(std::move(refuted)),
      rows_(recording.rows()) {}

Eigen::MatrixXd TermModel::evaluate(const Eigen::VectorXd& values) const {
  Eigen::MatrixXd simulated = simulation_->predict(inputs().values, values);
  if (simulated.rows() != inputs().values.rows() || simulated.cols() != std::ssize(outputs_)) {
    refuse("find_missing", fmt::format("the simulation gave {} x {} outputs, must be {} x {}", simulated.rows(),
                                       simulated.cols(), inputs().values.rows(), outputs_.size()));
  }
  return simulated;
}

const Eigen::MatrixXd& TermModel::simulated(const Eigen::VectorXd& values) const {
  // Differences by coefficients leave the simulation's own parameters alone.
  if (last_.size() == 0 || last_values_ != values) {
    last_ = evaluate(values);
    last_values_ = values;
  }
  return last_;
}

Eigen::MatrixXd TermModel::columns(const PlacedTerm& placed, const Eigen::MatrixXd& simulated) const {
  const ModelTerm& term = (*terms_)[placed.term];
  rows_.simulated = simulated.col(placed.output);
  Eigen::MatrixXd columns = term.columns(rows_, within_range(term, placed.constants));
  if (columns.rows() != simulated.rows() || columns.cols() != std::ssize(term.coefficients)) {
    refuse("find_missing", fmt::format("the term {} gave {} x {} values, must be {} x {}", label(placed),
                                       columns.rows(), columns.cols(), simulated.rows(), term.coefficients.size()));
  }
  return columns;
}

Eigen::MatrixXd TermModel::means_of(const PlacedTerm& placed, const Eigen::MatrixXd& simulated,
                                    const Samples& samples) const {
  const auto finite = [&] {
    Eigen::MatrixXd values = columns(placed, simulated);
    const Eigen::Index bad = first_bad_row(values);
    if (bad < values.rows()) {
      refuse("find_missing", fmt::format("the term {} is not finite at row {}", label(placed), bad + 1));
    }
    return values;
  };
  if (shared_ == nullptr || !samples.is_filtered() || !ColumnCache::holds((*terms_)[placed.term])) {
    return means(finite(), samples);
  }
  return shared_->at(samples, draw_, placed.term, finite);
}

Eigen::MatrixXd TermModel::columns_at(const PlacedTerm& placed, const Eigen::MatrixXd& simulated,
                                      const std::vector<Eigen::Index>& rows) const {
  if (few_of_ != rows) {
    few_of_ = rows;
    few_ = {.inputs = rows_.inputs(rows, Eigen::all),
            .simulated = {},
            .sequence = std::vector<Eigen::Index>(rows.size()),
            .instants = rows_.instants(rows)};
    std::iota(few_.sequence.begin(), few_.sequence.end(), Eigen::Index{0});
  }
  few_.simulated = simulated.col(placed.output)(rows);
  const ModelTerm& term = (*terms_)[placed.term];
  return term.columns(few_, within_range(term, placed.constants));
}

Eigen::MatrixXd TermModel::predict(const Eigen::VectorXd& values, const std::vector<PlacedTerm>& placed) const {
  const Eigen::MatrixXd& base = simulated(values);
  Eigen::MatrixXd predicted = base;
  for (const PlacedTerm& term : placed) predicted.col(term.output) += columns(term, base) * term.coefficients;
  return predicted;
}

Eigen::VectorXd TermModel::input(const std::string& name) const {
  const auto found = std::ranges::find(inputs().names, name);
  if (found == inputs().names.end())
    refuse("find_missing", fmt::format("a term depends on \"{}\", which is not an input", name));
  return inputs().values.col(found - inputs().names.begin());
}

std::string TermModel::label(const PlacedTerm& placed) const {
  const ModelTerm& term = (*terms_)[placed.term];
  std::string text = term.family;
  if (!term.location.empty()) text += " " + term.location;
  if (outputs_.size() > 1) text += " on " + outputs_[placed.output];
  return text;
}

namespace {

TermModel model_of_found(const Simulation& simulation, const Missing& missing, const std::vector<ModelTerm>& terms,
                         const Recording& recording) {
  std::vector<std::string> outputs;
  for (const Gap& gap : missing.gaps) outputs.push_back(gap.output);
  return {simulation, recording, std::move(outputs), terms};
}

Recording with_bands_of(const Missing& missing, const Recording& recording) {
  const bool has_bands = recording.inputs().zero_bands.size() > 0;
  return has_bands ? recording : recording.with_zero_bands(missing.zero_bands);
}

}  // namespace

Eigen::MatrixXd range_of_found_terms(const Simulation& simulation, const Missing& missing,
                                     const std::vector<ModelTerm>& terms, const Recording& as_given) {
  const Recording recording = with_bands_of(missing, as_given);
  const TermModel model = model_of_found(simulation, missing, terms, recording);
  const Eigen::VectorXd values = values_of(missing.parameters);
  const Eigen::MatrixXd added = model.predict(values, placed_terms(missing)) - model.simulated(values);
  std::vector<Eigen::Index> rows = missing.searched;
  rows.insert(rows.end(), missing.held_out.begin(), missing.held_out.end());
  Eigen::MatrixXd range(added.cols(), 2);
  range << added(rows, Eigen::all).colwise().minCoeff().transpose(),
      added(rows, Eigen::all).colwise().maxCoeff().transpose();
  return range;
}

Eigen::MatrixXd with_found_terms(const Simulation& simulation, const Missing& missing,
                                 const std::vector<ModelTerm>& terms, const Recording& elsewhere) {
  const Recording recording = with_bands_of(missing, elsewhere);
  const TermModel model = model_of_found(simulation, missing, terms, recording);
  const Eigen::VectorXd values = values_of(missing.parameters);
  Eigen::MatrixXd predicted = model.predict(values, placed_terms(missing));
  if (missing.range_of_terms.size() == 0 || !are_terms_held(missing)) return predicted;
  const Eigen::MatrixXd& base = model.simulated(values);
  for (Eigen::Index o = 0; o < predicted.cols(); ++o) {
    const auto added = (predicted.col(o) - base.col(o)).array();
    predicted.col(o) = base.col(o).array() + added.max(missing.range_of_terms(o, 0)).min(missing.range_of_terms(o, 1));
  }
  return predicted;
}

Eigen::VectorXd values_of(const std::vector<Parameter>& parameters) {
  Eigen::VectorXd values(std::ssize(parameters));
  for (std::size_t k = 0; k < parameters.size(); ++k) values(static_cast<Eigen::Index>(k)) = parameters[k].value;
  return values;
}

std::vector<PlacedTerm> placed_terms(const Missing& missing) {
  std::vector<PlacedTerm> placed;
  for (const FoundTerm& found : missing.found) {
    placed.push_back({found.term, found.output_index, found.constants, found.coefficients, 0.0});
  }
  return placed;
}

Eigen::VectorXd within_range(const ModelTerm& term, Eigen::VectorXd constants) {
  for (Eigen::Index k = 0; k < constants.size(); ++k) {
    const std::vector<double>& tried = term.constants[static_cast<std::size_t>(k)].tried;
    double low = tried.front() - spacing(tried, tried.front());
    if (tried.front() > 0.0) low = std::max(low, 0.5 * tried.front());
    constants(k) = std::clamp(constants(k), low, tried.back() + spacing(tried, tried.back()));
  }
  return constants;
}

double spacing(const std::vector<double>& tried, double value) {
  if (tried.size() < 2) return std::max(smallest_divisor, 0.01 * std::abs(value));
  const auto above = std::ranges::lower_bound(tried, value);
  const auto k = std::clamp<Eigen::Index>(above - tried.begin(), 1, std::ssize(tried) - 1);
  return std::max(smallest_divisor, tried[k] - tried[k - 1]);
}

}  // namespace llmt::discovery
