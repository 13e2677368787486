// A simulation with terms added, and the columns of terms.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "discovery/recording/recording.hpp"
#include "discovery/recording/samples.hpp"
#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Where a value may be 0, as a constant on the way of a fit, this is divided by.
inline constexpr double smallest_divisor = 1e-300;
/// The exponential of more is no number.
inline constexpr double largest_exponent = 700.0;

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

/// A term without constants that is a function of the inputs alone is the same in every search of the same rows. It is
/// computed at all rows and filtered once, at all rows that may be samples.
class ColumnCache {
 public:
  /// Of filtered rows.
  explicit ColumnCache(const Recording& recording);

  static bool holds(const ModelTerm& term);

  /// Whether a term with constants is a function of the inputs alone.
  static bool holds_grid(const ModelTerm& term);

  /// Whether it is one of their past: a state that they move.
  static bool is_state_of_inputs(const ModelTerm& term);

  /// samples x k. `draw`: 0 for the inputs as they are, else the number of the draw of their errors. `columns` computes
  /// them at all rows.
  Eigen::MatrixXd at(const Samples& samples, std::size_t draw, std::size_t term,
                     const std::function<Eigen::MatrixXd()>& columns);

  /// samples x m: columns of a term with constants at all values of them that are tried. `columns` computes them at the
  /// samples it is given.
  Eigen::MatrixXd grid_at(const Samples& samples, std::size_t term, const std::vector<Eigen::VectorXd>& tried,
                          const std::function<Eigen::MatrixXd(const Samples&)>& columns);

 private:
  Samples all_;
  std::vector<Eigen::Index> places_;  // of each row among them; -1: none
  std::map<std::pair<std::size_t, std::size_t>, Eigen::MatrixXd> columns_;
  std::map<std::pair<std::size_t, std::vector<double>>, Eigen::MatrixXd> grids_;

  Eigen::MatrixXd of_samples(const Eigen::MatrixXd& all, const Samples& samples) const;
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

/// Missing::range_of_terms at the rows that were searched and those set aside.
Eigen::MatrixXd range_of_found_terms(const Simulation& simulation, const Missing& missing,
                                     const std::vector<ModelTerm>& terms, const Recording& as_given);

/// What corrected() of llmt/discovery/simulation.hpp returns.
Eigen::MatrixXd with_found_terms(const Simulation& simulation, const Missing& missing,
                                 const std::vector<ModelTerm>& terms, const Recording& elsewhere);

Eigen::VectorXd values_of(const std::vector<Parameter>& parameters);

/// The terms of an answer.
std::vector<PlacedTerm> placed_terms(const Missing& missing);

/// The first row with a value that is not finite, or the number of rows.
Eigen::Index first_bad_row(const Eigen::MatrixXd& values);

/// Constants within the values tried and a step beyond; those of positive constants stay positive. A fit may ask for
/// others on its way, at which a term need not be finite.
Eigen::VectorXd within_range(const ModelTerm& term, Eigen::VectorXd constants);

/// The distance between the values tried around `value`.
double spacing(const std::vector<double>& tried, double value);

}  // namespace llmt::discovery
