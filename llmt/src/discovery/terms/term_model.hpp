// A simulation with terms added: prediction, refit, trial of constants.
#pragma once

#include <memory>
#include <set>
#include <vector>

#include "discovery/recording/samples.hpp"
#include "discovery/terms/column_cache.hpp"
#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// A term on one output with its constants and coefficients.
struct PlacedTerm {
  std::size_t term = 0;
  Eigen::Index output = 0;
  Eigen::VectorXd constants;
  Eigen::VectorXd coefficients;
  double prior_cost = 0.0;
  double explained = 0.0;       ///< of the sum of squares, by best_constants()
  std::vector<bool> held = {};  ///< coefficients that are not fitted, see hold(); empty: all are

  bool is_held(Eigen::Index coefficient) const { return !held.empty() && held[coefficient]; }
};

/// Evaluates on all rows, those set aside included, because terms may depend on the inputs of the row before.
class TermModel {
 public:
  /// Keeps references.
  TermModel(const Simulation& simulation, const Recording& recording, std::vector<std::string> outputs,
            const std::vector<ModelTerm>& terms, std::set<std::size_t> refuted = {});

  /// Columns that searches share; `draw`: of the errors of the inputs, 0: none.
  void share(std::shared_ptr<ColumnCache> columns, std::size_t draw) {
    shared_ = std::move(columns);
    draw_ = draw;
  }
  const std::shared_ptr<ColumnCache>& shared() const { return shared_; }

  const std::vector<ModelTerm>& terms() const { return *terms_; }
  /// Terms that were refuted are no candidates.
  bool is_refuted(std::size_t term) const { return refuted_.contains(term); }
  const std::vector<Parameter>& parameters() const { return simulation_->parameters; }
  const std::vector<std::string>& outputs() const { return outputs_; }

  /// n x d, without terms. Throws std::invalid_argument if it has another shape or is not finite.
  const Eigen::MatrixXd& simulated(const Eigen::VectorXd& values) const;
  /// n x k of the term at the simulated outputs. Throws std::invalid_argument naming the term.
  Eigen::MatrixXd columns(const PlacedTerm& placed, const Eigen::MatrixXd& simulated) const;
  /// Means over samples of the columns. Throws std::invalid_argument naming the term where it is not finite.
  Eigen::MatrixXd means_of(const PlacedTerm& placed, const Eigen::MatrixXd& simulated, const Samples& samples) const;
  /// As columns(), at some rows alone, of a term that does not depend on other rows.
  Eigen::MatrixXd columns_at(const PlacedTerm& placed, const Eigen::MatrixXd& simulated,
                             const std::vector<Eigen::Index>& rows) const;
  /// n x d.
  Eigen::MatrixXd predict(const Eigen::VectorXd& values, const std::vector<PlacedTerm>& placed) const;

  const Recording& recording() const { return *recording_; }
  const Inputs& inputs() const { return recording_->inputs(); }
  /// Values of an input. Throws std::invalid_argument if there is none of that name.
  Eigen::VectorXd input(const std::string& name) const;

  /// "square a", with "on y2" where there are several outputs.
  std::string label(const PlacedTerm& placed) const;

 private:
  const Simulation* simulation_;
  const Recording* recording_;
  std::vector<std::string> outputs_;
  const std::vector<ModelTerm>* terms_;
  std::set<std::size_t> refuted_;
  std::shared_ptr<ColumnCache> shared_;
  std::size_t draw_ = 0;
  mutable Rows rows_;
  mutable std::vector<Eigen::Index> few_of_;  // rows of `few_`
  mutable Rows few_;
  mutable Eigen::VectorXd last_values_;
  mutable Eigen::MatrixXd last_;
  Eigen::MatrixXd evaluate(const Eigen::VectorXd& values) const;
};

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

/// What corrected() of llmt/discovery/simulation.hpp returns.
Eigen::MatrixXd with_found_terms(const Simulation& simulation, const Missing& missing,
                                 const std::vector<ModelTerm>& terms, const Recording& elsewhere);

Eigen::VectorXd values_of(const std::vector<Parameter>& parameters);

/// The terms of an answer.
std::vector<PlacedTerm> placed_terms(const Missing& missing);

/// Autocorrelation of stacked residuals of samples in time, for each output, see autocorrelation(); d empty lists for
/// samples that are not in time.
std::vector<std::vector<double>> correlations_of(const TermData& data, const Eigen::VectorXd& residuals);

/// The first row with a value that is not finite, or the number of rows.
Eigen::Index first_bad_row(const Eigen::MatrixXd& values);

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
/// those in `taken` do not count.
std::vector<PlacedTerm> best_constants(const TermModel& model, const TermData& data, const TrialGround& ground,
                                       std::size_t term, Eigen::Index output, const Eigen::MatrixXd& simulated,
                                       const std::vector<PlacedTerm>& taken);

/// Distance from a constant, of this number, to the next value tried at which the sum of squares is larger by more than
/// the variance of what is left.
double trial_error(const TermModel& model, const TermData& data, const TrialGround& ground, const PlacedTerm& placed,
                   Eigen::Index constant, const Eigen::MatrixXd& simulated);

/// Constants within the values tried and a step beyond; those of positive constants stay positive. A fit may ask for
/// others on its way, at which a term need not be finite.
Eigen::VectorXd within_range(const ModelTerm& term, Eigen::VectorXd constants);

/// The distance between the values tried around `value`.
double spacing(const std::vector<double>& tried, double value);

}  // namespace llmt::discovery
