/// \file
/// What a control engineer asks of a model of a system that moves: poles, gains, and tests of its residuals.
///
///     const std::vector<llmt::LocalDynamics> all = llmt::local_dynamics(llmt::load_dynamic("drive.json"));
///     const double slowest = all.front().poles.front().time_constant;
#pragma once

#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/dynamic_model.hpp"
#include "llmt/series.hpp"

namespace llmt {

/// A pole z of a linear model with the sample time T, and s = ln(z) / T.
struct Pole {
  std::complex<double> z;
  double frequency = 0.0;      ///< |s| / (2 pi), per time unit: Hz where that is s
  double damping = 0.0;        ///< -Re(s) / |s|; negative: the oscillation grows
  double time_constant = 0.0;  ///< -1 / Re(s); infinite on the unit circle, negative outside
};

/// The linear model in whose neighbourhood the system moves near a point.
struct LocalDynamics {
  std::string where;            ///< "leaf 2", "y = 0.3", "at rest, u = 0.2" or "everywhere"
  std::vector<Pole> poles;      ///< the slowest first; those at z = 0 (pure delays) are left out
  Eigen::MatrixXd steady_gain;  ///< outputs x inputs, (1 - A)^-1 B; NaN where a pole is at z = 1
  bool is_stable = true;        ///< no pole outside of the unit circle
  /// Changes of the outputs: dy(t) = sum_k of_outputs[k - 1] dy(t - k) + sum_k of_inputs[k] du(t - k), k = 1, 2, ... of
  /// the outputs (outputs x outputs) and 0, 1, ... of the inputs (outputs x inputs).
  std::vector<Eigen::MatrixXd> of_outputs = {};
  std::vector<Eigen::MatrixXd> of_inputs = {};
};

/// Of a tree: at the mean row of each leaf. Of one with oblique splits (HILOMOT), which does not know where the rows of
/// a leaf lie: where the model rests at five values of the first input that changes (static_curve()). Of a polynomial
/// of degree 2 or 3, and of an oblique tree without such states: with the first output at rest at its smallest, middle
/// and largest training value. Of a linear model: one.
std::vector<LocalDynamics> local_dynamics(const DynamicModel& model);

/// The linear model at a row of regressors, see DynamicModel::columns().
LocalDynamics dynamics_at(const DynamicModel& model, const Eigen::VectorXd& regressors, std::string where);

/// Step response: the change of the outputs at the rows 0, 1, ... if an input rises by 1 at row 0 and stays; rows x
/// outputs, in units of the outputs a unit of the input. Throws std::invalid_argument if there is no such input or row.
Eigen::MatrixXd step_response(const LocalDynamics& local, Eigen::Index input, Eigen::Index rows);

/// The row from which on all step responses stay within 2 per cent of their steady gain: the settling time in rows. -1:
/// one does not settle, or takes more than 100 000 rows.
Eigen::Index settled_rows(const LocalDynamics& local);

/// Correlations of the residuals of one output (Ljung 1999, ch. 16.6) with their bounds, within which they lie with a
/// probability of 99 % each if nothing is left.
struct ResidualTests {
  std::string output;
  /// Whiteness of the errors of the next row: correlation of e(t) with e(t - k), k = 1 ... 25.
  Eigen::VectorXd autocorrelation;
  double autocorrelation_bound = 0.0;
  /// Correlation of the errors of runs with each input u(t - k), k = 0 ... 25; inputs x lags.
  Eigen::MatrixXd cross_correlation;
  /// Spectra of the errors of the next row and of runs by Welch's method (Welch 1967): mean squares for each unit of
  /// frequency, at `frequency` in 1 / time unit, from segments of at most 256 rows, half over each other, in a Hann
  /// window. The area below a spectrum is the mean square of the errors about their mean. Empty where errors have no 16
  /// rows without a gap.
  Eigen::VectorXd frequency = {};
  Eigen::VectorXd next_row_spectrum = {};
  Eigen::VectorXd run_spectrum = {};
  Eigen::VectorXd cross_correlation_bound;  ///< one an input; allows for what either of the two correlates with itself

  Eigen::Index autocorrelations_outside() const;
  Eigen::Index cross_correlations_outside() const;
};

/// The tests on a series, one an output. `simulated`: rows of the series x outputs, NaN where there is no run, as
/// DynamicFit::simulated. Throws std::invalid_argument if shapes differ.
std::vector<ResidualTests> residual_tests(const DynamicModel& model, const Series& series,
                                          const Eigen::Ref<const Eigen::MatrixXd>& simulated);

}  // namespace llmt
