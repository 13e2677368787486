// What is known of the errors of the inputs, what they do to a search, and how it is undone.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "discovery/answer/term_fit.hpp"
#include "discovery/recording/row_split.hpp"
#include "discovery/recording/surrogate.hpp"
#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {

/// The simulation was computed at x + e, e the errors of the inputs, so residuals hold s(x) - s(x + e), and the
/// signature T(x + e) of a term holds e too: in expectation T'r is off by E[T(x + e)'(s(x) - s(x + e))] even where
/// nothing is missing. Errors are drawn again, in pairs e, -e: added to the inputs as they are they do the same once
/// more, to second order, so what they add is subtracted (corrected score of Nakamura 1990; the extrapolation of SIMEX,
/// Cook and Stefanski 1994, with a straight line). The simulation at other inputs is described by a Surrogate.
class InputNoise {
 public:
  /// Keeps a reference to `model`.
  InputNoise(const TermModel& model, const Eigen::MatrixXd& simulated);

  /// What signature' residuals of a placed term lacks for the errors, k; `simulated` as stacked_signature() takes it.
  Eigen::VectorXd moment_correction(const TermData& data, const PlacedTerm& placed,
                                    const Eigen::MatrixXd& simulated) const;

  /// Of terms that change samples by c: what the errors add to its sum of squares, E |dc|^2, and to the error that the
  /// terms leave, E |dc|^2 + 2 E dc' dy, where dy is the change of the simulation; in units of the scatter of each
  /// output.
  struct AddedByErrors {
    double change = 0.0;
    double left = 0.0;
  };
  AddedByErrors added(const TermData& data, const std::vector<PlacedTerm>& placed,
                      const Eigen::MatrixXd& simulated) const;

  /// Estimates and standard errors of a fit corrected for the errors: steps (J'J - D)^-1 (J'r + g), D = E[dJ'dJ] and
  /// g = E[J'dy], where J is the Jacobian of the fit and dJ, dy are the changes of J and of the prediction that drawn
  /// errors make (Fuller 1987, section 3.1). Standard errors are those of the sandwich of the samples' scores. Returns
  /// the names of parameters and terms that cannot be corrected, because more than half of what determines them are
  /// errors; these keep their values.
  std::vector<std::string> correct(const TermData& data, TermFit& fit) const;

  /// d: share of the variance of the simulation that the surrogate describes.
  const Eigen::VectorXd& described() const { return surrogate_->described(); }
  /// Rows x d: mean square of what the errors add to the prediction of a fit, as it is measured.
  Eigen::MatrixXd variances(const TermFit& fit) const;
  /// Samples x d: mean square of what the errors add to the simulated outputs.
  Eigen::MatrixXd variances(const Samples& samples) const;

 private:
  struct Draw;
  const TermModel* model_;
  std::shared_ptr<const Surrogate> surrogate_;
  std::vector<std::shared_ptr<const Draw>> draws_;
};

struct ErrorsOfInputs {
  std::unique_ptr<const InputNoise> noise;  ///< none where no errors are known, or cannot be taken out
  Eigen::VectorXd deviations;               ///< standard deviations, one an input; empty where noise is none
  std::vector<std::string> uncorrected;     ///< labels of terms whose estimates could not be corrected
  std::vector<std::string> notes;
};

/// Takes rows out of the split at which the sign of an input is not known. `start`: values of the parameters.
ErrorsOfInputs errors_of_inputs(const TermModel& model, const MeasuredOutputs& measured, const Eigen::VectorXd& start,
                                RowSplit& split);

/// Corrects the estimates of the fit, and remembers those that cannot be corrected.
void correct_estimates(ErrorsOfInputs& errors, const TermData& kept, TermFit& fit);

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
