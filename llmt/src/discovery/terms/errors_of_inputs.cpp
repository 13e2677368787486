#include "discovery/terms/errors_of_inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "discovery/recording/apart.hpp"
#include "discovery/terms/decision.hpp"

namespace llmt::discovery {

ErrorsOfInputs errors_of_inputs(const TermModel& model, const MeasuredOutputs& measured, const Eigen::VectorXd& start,
                                RowSplit& split) {
  ErrorsOfInputs errors;
  const Recording& recording = model.recording();
  const Inputs& inputs = recording.inputs();
  if (inputs.instants.size() == 0 && inputs.noise.size() == 0) return errors;
  const Eigen::MatrixXd simulated = model.simulated(start);
  if (!simulated.allFinite()) return errors;
  const Eigen::MatrixXd& covariance = recording.covariance();
  if (!(covariance.diagonal().array() > 0.0).any()) return errors;
  const std::vector<Apart> unknown = rows_apart(ApartWhen::before_a_fit, {recording, measured, simulated});
  if (!unknown.empty()) {
    std::vector<bool> apart(inputs.values.rows(), false);
    mark(unknown, apart);
    tell(unknown, errors.notes);
    split = without_rows(split, apart);
  }
  auto noise = std::make_unique<InputNoise>(model, simulated);
  std::vector<std::string> deviations;
  for (std::size_t j = 0; j < inputs.names.size(); ++j) {
    const double own = std::sqrt(covariance(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(j)));
    if (own > 0.0) deviations.push_back(fmt::format("{} {:.2g}", inputs.names[j], own));
  }
  const bool is_told = inputs.noise.size() > 0 && !inputs.noise.array().isNaN().any();
  const bool is_described = noise->described().minCoeff() >= roughly_described;
  errors.notes.push_back(fmt::format(
      "errors of the inputs {} (standard deviations): {}; {}", is_told ? "as told" : "from neighbouring rows",
      fmt::join(deviations, ", "),
      is_described ? "what they add to the deviations was taken out"
                   : "what they add to the deviations is not known, because no function of the inputs describes the "
                     "simulation"));
  if (is_described) {
    errors.noise = std::move(noise);
    errors.deviations = covariance.diagonal().cwiseSqrt();
  }
  return errors;
}

void correct_estimates(ErrorsOfInputs& errors, const TermData& kept, TermFit& fit) {
  if (errors.noise) errors.uncorrected = errors.noise->correct(kept, fit);
}

void doubt_uncorrected(const ErrorsOfInputs& errors, Missing& missing) {
  for (std::size_t k = 0; k < missing.found.size(); ++k) {
    const FoundTerm& found = missing.found[k];
    std::string label = found.family;
    if (!found.location.empty()) label += " " + found.location;
    if (missing.gaps.size() > 1) label += " on " + found.output;
    if (std::ranges::find(errors.uncorrected, label) == errors.uncorrected.end()) continue;
    object(missing, Reason::errors_of_inputs, {k});
    missing.notes.push_back(
        fmt::format("{}: errors of the inputs are more than half of it, so they alone could make this term", label));
  }
}

}  // namespace llmt::discovery
