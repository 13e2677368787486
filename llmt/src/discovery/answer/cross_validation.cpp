// Predictions of stretches that no fit has used.
#include <algorithm>
#include <cmath>
#include <limits>

#include "discovery/answer/contests.hpp"
#include "discovery/answer/findings.hpp"
#include "discovery/answer/question.hpp"
#include "discovery/recording/row_split.hpp"
#include "discovery/recording/samples.hpp"

namespace llmt::discovery {

CrossValidation::CrossValidation(const Simulation& simulation, const Recording& recording,
                                 const MeasuredOutputs& measured, const std::vector<ModelTerm>& terms,
                                 const SearchedRows& rows, const MissingOptions& options)
    : simulation_(&simulation),
      recording_(&recording),
      terms_(&terms),
      outputs_(measured.names),
      columns_(rows.columns) {
  const RowSplit split = split_of_all(recording, rows, options);
  data_ = {.samples = split.searched,
           .measured = means_of_filtered(measured.values, split.searched),
           .sigma = Eigen::VectorXd::Ones(measured.values.cols()),
           .stretches = {}};
}

Eigen::MatrixXd CrossValidation::errors(const Missing& answer, const Eigen::MatrixXd& weights) const {
  constexpr Eigen::Index folds = 5;
  constexpr Eigen::Index stretches = 2 * folds;
  Simulation simulation = *simulation_;
  simulation.parameters = answer.parameters;
  TermModel model(simulation, *recording_, outputs_, *terms_);
  model.share(columns_, 0);
  const Eigen::VectorXd start = values_of(answer.parameters);
  const std::vector<PlacedTerm> placed = placed_terms(answer);
  TermData data = data_;
  if (weights.size() > 0) data.weights = std::make_shared<const Eigen::MatrixXd>(weights);
  for (std::size_t o = 0; o < answer.gaps.size(); ++o) {
    if (answer.gaps[o].noise_floor > 0.0) data.sigma(static_cast<Eigen::Index>(o)) = answer.gaps[o].noise_floor;
  }
  const Eigen::Index n = data.samples.size();
  Eigen::MatrixXd errors(n, data.measured.cols());
  for (Eigen::Index fold = 0; fold < folds; ++fold) {
    std::vector<std::size_t> left_out;
    std::vector<std::size_t> used;
    for (Eigen::Index i = 0; i < n; ++i) {
      (i * stretches / n % folds == fold ? left_out : used).push_back(static_cast<std::size_t>(i));
    }
    if (left_out.empty()) continue;
    const TermData fitted = without_samples(data, left_out);
    std::vector<PlacedTerm> own = placed;
    hold(model, fitted, start, own);
    const TermFit fit = fit_terms(model, fitted, start, own);
    const TermData unused = without_samples(data, used);
    const Eigen::VectorXd stacked = scaled_residuals(model, unused, fit.parameters, fit.placed);
    const Eigen::Index d = data.measured.cols();
    for (std::size_t k = 0; k < left_out.size(); ++k) {
      errors.row(static_cast<Eigen::Index>(left_out[k])) =
          stacked.segment(static_cast<Eigen::Index>(k) * d, d).cwiseProduct(data.sigma).transpose();
    }
  }
  return errors;
}

Advantage advantage(const Eigen::MatrixXd& found, const Eigen::MatrixXd& other, const Eigen::VectorXd& floors,
                    double independent_share) {
  Advantage sum;
  double variance = 0.0;
  for (Eigen::Index o = 0; o < found.cols(); ++o) {
    const Eigen::ArrayXd own = found.col(o).cwiseAbs();
    const Eigen::ArrayXd others = other.col(o).cwiseAbs();
    const Eigen::ArrayXd counts = (own.min(others) <= far_off * floors(o)).cast<double>();
    const double smallest = std::numeric_limits<double>::min();
    const double n = counts.sum();
    const double left = (counts * own.square()).sum() + smallest;
    const double left_by_other = (counts * others.square()).sum() + smallest;
    const double of_a_sample = 0.5 * independent_share * std::log(left / left_by_other);
    sum.log_likelihood += n * of_a_sample;
    if (!((own - others).abs().maxCoeff() > 0.0)) continue;
    // Of each sample, less the mean.
    const Eigen::ArrayXd scatter =
        0.5 * independent_share * n * counts * (own.square() / left - others.square() / left_by_other);
    const auto length = static_cast<Eigen::Index>(std::ceil(2.0 / independent_share));
    double squares = 0.0;
    double blocks = 0.0;
    for (Eigen::Index i = 0; i < scatter.size(); i += length, ++blocks) {
      squares += std::pow(scatter.segment(i, std::min(length, scatter.size() - i)).sum(), 2.0);
    }
    variance += blocks > 1.0 ? squares * blocks / (blocks - 1.0) : std::numeric_limits<double>::infinity();
  }
  sum.standard_error = std::sqrt(variance);
  return sum;
}

}  // namespace llmt::discovery
