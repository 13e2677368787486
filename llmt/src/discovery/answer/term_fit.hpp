// Parameters and terms fitted together, and constants of terms that are tried.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "discovery/recording/samples.hpp"
#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {

/// As SearchOptions::absorbed_tolerance: a column of which no more than this lies outside of others is not told from
/// them.
inline constexpr double absorbed_share = 1e-3;

/// Samples that are fitted, measured outputs there, and how much an output's deviation counts.
struct TermData {
  Samples samples;
  Eigen::MatrixXd measured;                                     // samples x d
  Eigen::VectorXd sigma;                                        // d
  std::vector<Eigen::Index> stretches;                          // RowSplit::stretches; empty: samples are not in time
  double independent_share = 1.0;                               // of the samples, see search()
  std::shared_ptr<const Eigen::MatrixXd> weights = {};          // roots, of rows x d, see weigh(); none: all 1
  std::shared_ptr<const Eigen::MatrixXd> known_variances = {};  // of the errors of rows x d; none: see weigh()
};

/// Roots of the weights of the samples of an output.
Eigen::VectorXd weights_of(const TermData& data, Eigen::Index output);

TermData without_samples(const TermData& data, const std::vector<std::size_t>& left_out);

/// Parameters and placed terms fitted together.
struct TermFit {
  Eigen::VectorXd parameters;
  Eigen::VectorXd parameter_errors;
  std::vector<PlacedTerm> placed;
  std::vector<Eigen::VectorXd> errors;  // of the coefficients, then the constants, of each placed term
};

/// Holds the coefficients of whole terms at 1, and at 0 those whose column is, to a thousandth of its length, a
/// combination of the derivatives by the free parameters and of the term's columns before it: C cos q + S sin q beside
/// a mass, whose derivative is cos q, leaves S to the term and the rest to the mass.
void hold(const TermModel& model, const TermData& data, const Eigen::VectorXd& parameters,
          std::vector<PlacedTerm>& placed);

TermFit fit_terms(const TermModel& model, const TermData& data, const Eigen::VectorXd& start,
                  const std::vector<PlacedTerm>& placed);

/// Autocorrelation of stacked residuals of samples in time, for each output, see autocorrelation(); d empty lists for
/// samples that are not in time.
std::vector<std::vector<double>> correlations_of(const TermData& data, const Eigen::VectorXd& residuals);

/// (measured - predicted) weight / sigma, stacked sample by sample.
Eigen::VectorXd scaled_residuals(const TermModel& model, const TermData& data, const Eigen::VectorXd& parameters,
                                 const std::vector<PlacedTerm>& placed);

/// Derivatives of -scaled_residuals() by the free parameters.
Eigen::MatrixXd baseline_jacobian(const TermModel& model, const TermData& data, const Eigen::VectorXd& parameters,
                                  const std::vector<PlacedTerm>& placed);

/// Columns of a placed term, stacked like the residuals.
Eigen::MatrixXd stacked_signature(const TermModel& model, const TermData& data, const PlacedTerm& placed,
                                  const Eigen::MatrixXd& simulated);

/// Residuals and nuisance that constants of terms are tried on.
struct TrialGround {
  Eigen::VectorXd residuals;  // stacked
  Eigen::MatrixXd nuisance;   // stacked; what may explain residuals besides the term
};

/// The best constants of a term on one output, each with the prior cost of its choice; constants within two steps of
/// those in `taken` do not count. `threshold`: that of a term that acts in a regime, held.
std::vector<PlacedTerm> best_constants(const TermModel& model, const TermData& data, const TrialGround& ground,
                                       std::size_t term, Eigen::Index output, const Eigen::MatrixXd& simulated,
                                       const std::vector<PlacedTerm>& taken, std::optional<double> threshold = {});

/// Places the threshold of a term that acts in a regime and has another constant between the values that are tried,
/// and fits both in turn; other terms stay as they are. best_constants() does the same for a threshold alone.
void refine_regime(const TermModel& model, const TermData& data, const TrialGround& ground,
                   const Eigen::MatrixXd& simulated, PlacedTerm& placed);

/// Distance from a constant, of this number, to the next value tried at which the sum of squares is larger by more than
/// the variance of what is left.
double trial_error(const TermModel& model, const TermData& data, const TrialGround& ground, const PlacedTerm& placed,
                   Eigen::Index constant, const Eigen::MatrixXd& simulated);

}  // namespace llmt::discovery
