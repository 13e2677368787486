#include "discovery/terms/term_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "discovery/recording/refuse.hpp"
#include "llmt/discovery/least_squares.hpp"

namespace llmt::discovery {

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

Eigen::VectorXd weights_of(const TermData& data, Eigen::Index output) {
  if (!data.weights) return Eigen::VectorXd::Ones(data.samples.size());
  return means_of_filtered(data.weights->col(output), data.samples);
}

Eigen::VectorXd scaled_residuals(const TermModel& model, const TermData& data, const Eigen::VectorXd& parameters,
                                 const std::vector<PlacedTerm>& placed) {
  const Eigen::MatrixXd& simulated = model.simulated(parameters);
  Eigen::MatrixXd predicted = means(simulated, data.samples);
  for (const PlacedTerm& term : placed) {
    predicted.col(term.output) += model.means_of(term, simulated, data.samples) * term.coefficients;
  }
  const Eigen::Index d = data.measured.cols();
  Eigen::VectorXd residuals(data.measured.size());
  for (Eigen::Index o = 0; o < d; ++o) {
    residuals(Eigen::seqN(o, data.measured.rows(), d)) =
        (data.measured.col(o) - predicted.col(o)).cwiseProduct(weights_of(data, o)) / data.sigma(o);
  }
  return residuals;
}

Eigen::MatrixXd baseline_jacobian(const TermModel& model, const TermData& data, const Eigen::VectorXd& parameters,
                                  const std::vector<PlacedTerm>& placed) {
  LeastSquaresProblem problem;
  problem.parameters = model.parameters();
  problem.residual = [&](const Eigen::VectorXd& values) { return scaled_residuals(model, data, values, placed); };
  std::vector<Eigen::Index> free;
  for (std::size_t k = 0; k < problem.parameters.size(); ++k) {
    if (problem.parameters[k].free) free.push_back(k);
  }
  if (free.empty()) return Eigen::MatrixXd(data.measured.size(), 0);
  return -difference_jacobian(problem, parameters)(Eigen::all, free);
}

Eigen::MatrixXd stacked_signature(const TermModel& model, const TermData& data, const PlacedTerm& placed,
                                  const Eigen::MatrixXd& simulated) {
  const Eigen::MatrixXd of_samples = model.means_of(placed, simulated, data.samples);
  const Eigen::Index d = data.measured.cols();
  Eigen::MatrixXd signature = Eigen::MatrixXd::Zero(data.measured.size(), of_samples.cols());
  const Eigen::VectorXd scale = weights_of(data, placed.output) / data.sigma(placed.output);
  signature(Eigen::seqN(placed.output, data.measured.rows(), d), Eigen::all) = scale.asDiagonal() * of_samples;
  return signature;
}

Eigen::MatrixXd with_found_terms(const Simulation& simulation, const Missing& missing,
                                 const std::vector<ModelTerm>& terms, const Recording& elsewhere) {
  const bool has_bands = elsewhere.inputs().zero_bands.size() > 0;
  const Recording recording = has_bands ? elsewhere : elsewhere.with_zero_bands(missing.zero_bands);
  std::vector<std::string> outputs;
  for (const Gap& gap : missing.gaps) outputs.push_back(gap.output);
  return TermModel(simulation, recording, outputs, terms).predict(values_of(missing.parameters), placed_terms(missing));
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

}  // namespace llmt::discovery
