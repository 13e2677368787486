// How much each sample counts: less where errors of the inputs move what is computed.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "discovery/terms/input_noise.hpp"
#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {

/// What is known of errors beforehand.
struct KnownErrors {
  const InputNoise* of_inputs = nullptr;  ///< none: not known
  Eigen::VectorXd of_outputs;             ///< d, standard deviations at a row; empty: not known

  /// Whether errors of samples can be told apart: of rows that went through a known filter.
  bool can_weigh(const TermData& data) const {
    return data.samples.is_filtered() && of_outputs.size() > 0 && (of_outputs.array() > 0.0).all();
  }
};

/// s^2 with sum_i r_i^2 / (s^2 + v_i) = the number of residuals r: the variance that they have beside known variances
/// v (Paule and Mandel 1982). At least `least`.
double variance_beside(const Eigen::VectorXd& residuals, const Eigen::VectorXd& known, double least);

/// Sets the weights of `data`: an error of output o at sample i has the variance s_o^2 + v_io, v what errors of the
/// inputs and steps between rows make of the prediction, s_o^2 what the residuals of the fit have beside it, at least
/// that of the noise of the output. Sets the known variances too, v and that noise. The squares of the weights,
/// proportional to 1 / (s_o^2 + v_io), are 1 in the mean of the samples without those in `outliers`. Returns s (d).
/// errors.can_weigh() holds.
Eigen::VectorXd weigh(const TermModel& model, const TermFit& fit, const KnownErrors& errors,
                      const std::vector<std::size_t>& outliers, TermData& data);

/// Root mean squares of columns (samples x d), the rows weighted.
Eigen::VectorXd weighted_rms(const Eigen::MatrixXd& of_samples, const TermData& data);

}  // namespace llmt::discovery
