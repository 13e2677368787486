#include "discovery/answer/errors_of_inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "discovery/recording/apart.hpp"
#include "discovery/recording/samples.hpp"

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

namespace {

// A few draws tell a variance by chance: where it happens to be small its row would count for many. So it is the mean
// over the rows within an independent step, and no less than the median: rows are less certain than most, or alike.
Eigen::VectorXd moderated(const Eigen::VectorXd& variances, const RowFilter& filter) {
  Eigen::VectorXd means(variances.size());
  for (const std::vector<Eigen::Index>& piece : filter.pieces()) {
    const auto n = std::ssize(piece);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Eigen::Index begin = std::max<Eigen::Index>(0, k - filter.stride());
      const Eigen::Index end = std::min(n, k + filter.stride() + 1);
      double sum = 0.0;
      for (Eigen::Index i = begin; i < end; ++i) sum += variances(piece[i]);
      means(piece[k]) = sum / static_cast<double>(end - begin);
    }
  }
  std::vector<double> sorted(means.begin(), means.end());
  const auto middle = sorted.begin() + std::ssize(sorted) / 2;
  std::ranges::nth_element(sorted, middle);
  return means.cwiseMax(*middle);
}

}  // namespace

double variance_beside(const Eigen::VectorXd& residuals, const Eigen::VectorXd& known, double least) {
  const Eigen::ArrayXd squares = residuals.array().square();
  const auto count = static_cast<double>(squares.size());
  const auto is_too_small = [&](double variance) { return (squares / (variance + known.array())).sum() > count; };
  if (!(least > 0.0) || !is_too_small(least)) return least;
  double low = least;
  double high = std::max(least, squares.mean());  // there each v makes the sum smaller
  constexpr int halvings = 60;
  for (int k = 0; k < halvings; ++k) {
    const double middle = std::sqrt(low * high);
    (is_too_small(middle) ? low : high) = middle;
  }
  return high;
}

Eigen::VectorXd weigh(const TermModel& model, const TermFit& fit, const KnownErrors& errors,
                      const std::vector<std::size_t>& outliers, TermData& data) {
  const Eigen::VectorXd& noise = errors.of_outputs;
  const Eigen::MatrixXd predicted = model.predict(fit.parameters, fit.placed);
  Eigen::MatrixXd variances = model.recording().squared_errors_of_steps(predicted);
  if (errors.of_inputs != nullptr) {
    const Eigen::MatrixXd of_inputs = errors.of_inputs->variances(fit);
    for (Eigen::Index o = 0; o < noise.size(); ++o)
      variances.col(o) += moderated(of_inputs.col(o), model.recording().filter());
  }
  const TermData kept = without_samples(data, outliers);
  const Eigen::MatrixXd left = kept.measured - means(predicted, kept.samples);
  const Eigen::MatrixXd at_kept = means_of_filtered(variances, kept.samples);
  Eigen::VectorXd spread(noise.size());
  auto weights = std::make_shared<Eigen::MatrixXd>(variances.rows(), variances.cols());
  for (Eigen::Index o = 0; o < noise.size(); ++o) {
    const double variance = variance_beside(left.col(o), at_kept.col(o), noise(o) * noise(o));
    spread(o) = std::sqrt(variance);
    const double mean = (variance + at_kept.col(o).array()).inverse().mean();
    weights->col(o) = (mean * (variance + variances.col(o).array())).rsqrt();
  }
  data.weights = std::move(weights);
  variances.rowwise() += noise.cwiseAbs2().transpose();
  data.known_variances = std::make_shared<const Eigen::MatrixXd>(std::move(variances));
  return spread;
}

Eigen::VectorXd weighted_rms(const Eigen::MatrixXd& of_samples, const TermData& data) {
  Eigen::VectorXd rms(of_samples.cols());
  for (Eigen::Index o = 0; o < rms.size(); ++o) {
    const Eigen::VectorXd own = of_samples.col(o).cwiseProduct(weights_of(data, o));
    rms(o) = std::sqrt(own.squaredNorm() / static_cast<double>(own.size()));
  }
  return rms;
}

}  // namespace llmt::discovery
