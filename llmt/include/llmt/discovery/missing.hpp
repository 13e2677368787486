/// \file
/// A simulation, its measurements, and what was found missing from it.
///
///     llmt::discovery::Simulation spring;  // of a stiffness that is only roughly known
///     spring.parameters = {{.name = "k", .unit = "N/mm", .value = 2.0, .scale = 0.1}};
///     spring.predict = [](const Eigen::MatrixXd& x, const Eigen::VectorXd& k) -> Eigen::MatrixXd { return k(0) * x; };
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/problem.hpp"
#include "llmt/discovery/verdict.hpp"
#include "llmt/progress.hpp"

namespace llmt::discovery {

/// A simulation with parameters that it may adjust (those that are free) before anything counts as missing.
struct Simulation {
  std::vector<Parameter> parameters = {};
  /// inputs (n x p), values of all parameters -> n x d outputs. find_missing() and corrected() call it on the thread
  /// that called them, one call at a time, and let through what it throws.
  std::function<Eigen::MatrixXd(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values)> predict;
};

/// A simulation that gives other outputs when it is run again at the same inputs and values.
class RandomSimulation : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

struct MeasuredOutputs {
  std::vector<std::string> names;  ///< d
  Eigen::MatrixXd values;          ///< n x d, beside Inputs::values
  /// d standard deviations of the noise of a row, as signals() knows them (NaN: not known), or empty: none is known.
  Eigen::VectorXd noise = {};
};

struct MissingOptions {
  double held_out_share = 0.2;  ///< of the rows, set aside before anything is looked at; equal inputs keep together
  std::uint64_t seed = 1;       ///< of the rows set aside
  int rounds = 4;               ///< of search and nonlinear refit
  Eigen::Index largest_sample = 4000;  ///< rows that are searched and fitted; of more a random part
  /// Formulas of terms are meant as they stand, and each is a cause of its own.
  SearchOptions search = {.model_error = 0.0, .member_materiality = 1e-3};
  Progress progress = {};  ///< the steps are "fitting", "searching, round 1", ...
};

struct TermValue {
  std::string name;
  std::string unit;
  double value = 0.0;
  /// NaN where the samples do not determine the value. For a constant that is not smooth, such as a threshold: the
  /// distance to the next value tried at which the sum of squares is larger by more than the variance of the noise.
  double standard_error = 0.0;
};

struct RivalTerms {
  std::string what;                 ///< "cube a", joined by " + " where it takes several
  std::vector<std::string> inputs;  ///< of these terms
  bool exact = false;               ///< the same at every row: these rows cannot distinguish them
};

/// A term that is missing.
struct FoundTerm {
  std::size_t term = 0;  ///< of the terms given
  std::string family;
  std::string location;
  std::string output;
  std::string formula;
  std::vector<std::string> inputs;  ///< ModelTerm::inputs
  bool generic = false;             ///< a shape, not a cause
  bool confirmed = false;           ///< no objection to it, nor to another term of its output
  Eigen::Index output_index = 0;
  Eigen::VectorXd coefficients;
  Eigen::VectorXd constants;
  bool whole = false;             ///< ModelTerm::whole
  std::vector<TermValue> values;  ///< coefficients (not those of a whole term), then constants
  std::vector<std::string> code;  ///< ModelTerm::code
  std::vector<RivalTerms> rivals;
  double share = 0.0;       ///< of the explained sum of squares that goes with it alone
  std::string inner_state;  ///< ModelTerm::inner_state
  std::string regime;       ///< ModelTerm::regime
  std::string shown_by;     ///< ModelTerm::shown_by
  /// The error on the samples set aside is smaller with it than without; true if there are none.
  bool shrinks_gap = true;
  bool is_refuted = false;  ///< it makes that error larger, by more than chance allows for a term of its size
};

/// How rows in time were used, see find_missing().
struct TimeUse {
  bool in_time = false;
  bool found_out = false;            ///< not told: neighbouring rows deviated alike
  bool filtered = false;             ///< simulation and terms went through the filter of the measured outputs
  Eigen::Index rows_per_sample = 1;  ///< a sample is the mean over a block of them
  Eigen::Index samples = 0;          ///< searched
  double step = 0.0;                 ///< median time between rows, in the unit of Inputs::instants
  double independent_share = 1.0;    ///< of the samples
  /// Time that counts as one independent value of what is left: step (1 + 2 sum_k rho_k), rho_k of neighbouring rows.
  double correlation_time = 0.0;
};

/// Root mean square errors of one output on the samples that were set aside (NaN if there are none): rows, or in time
/// the means over blocks of rows. Without outliers, as in the noise floor.
struct Gap {
  std::string output;
  double before = 0.0;        ///< the simulation, its own parameters adjusted
  double after = 0.0;         ///< with the terms found
  double noise_floor = 0.0;   ///< of the noise, from repeats where there are enough, else from what is left
  Eigen::Index outliers = 0;  ///< rows set aside that deviate by more than 5 noise floors both before and after
  double nominal = 0.0;       ///< the simulation as it was given, at the nominal values of its parameters
  /// Of the samples, from MeasuredOutputs::noise and from what errors of the inputs do to the simulation; NaN: not
  /// known.
  double known_noise = std::numeric_limits<double>::quiet_NaN();
};

/// What the rows say about a free parameter of the simulation, or about a sum of several that they cannot tell apart.
struct FittedParameter {
  std::string name;                ///< "mass", "mass + 0.25 armature"
  std::string unit;                ///< of the first
  std::vector<std::string> parts;  ///< names of the parameters in it
  double nominal = 0.0;            ///< at the values that were given
  double change = 0.0;             ///< fitted together with the terms found, minus `nominal`
  double standard_error = 0.0;     ///< of the change; NaN where the rows do not determine it
  double alone = 0.0;              ///< the change if no term is added
  bool changed = false;            ///< by more than chance
};

/// A part of the gap that is not noise and that no term explains: rows that are neighbours in some inputs deviate
/// alike.
struct Structure {
  std::string output;
  std::vector<std::string> inputs;  ///< that the most significant neighbourhood was taken in
  double p_value = 1.0;             ///< of that in noise, corrected for the neighbourhoods tried
  double share = 0.0;  ///< of the gap that can be explained (by the terms found, or as common to neighbours)
};

/// The smallest amplitude of a term that would have been found, 90 % of the time.
struct VisibleTerm {
  std::string what;
  double coefficient = 0.0;
  double rms = 0.0;  ///< of the change of the output that it makes
};

/// Why a term is not confirmed, or an answer not that of the search.
enum class Reason {
  larger_error,      ///< the terms make the error on the samples set aside larger
  known_noise,       ///< more is left of an output than 5 times its known noise
  drift,             ///< see is_drift()
  shape,             ///< a shape, not a cause
  structure,         ///< what is left of the output still depends on the inputs
  approximation,     ///< one of many terms of the same inputs, which together may stand for another function
  no_gain,           ///< it does not make the error on the samples set aside smaller
  vague_state,       ///< a state whose size is within two standard errors of 0
  errors_of_inputs,  ///< errors of the inputs are more than half of it
  rival,             ///< another term is as likely, and is another function
  likelier,          ///< another answer is likelier, but not certain either
};

/// As a clause, "it is a shape, not a cause".
std::string to_string(Reason reason);

struct Objection {
  Reason reason;
  std::vector<std::size_t> terms;  ///< numbers in Missing::found; empty: against the answer as a whole
};

/// Outcome of find_missing().
struct Missing {
  /// As Verdict::answer; but unknown if material structure is left although nothing was found, if is_drift(), and if
  /// not every term found is confirmed: what those stand for has no name yet. Failed_held_out if what was found makes
  /// the error on the samples set aside larger, and parameters_only if nothing was found and the parameters improve the
  /// score, see find_missing(). Inner_state if one of the named terms stands for a state that the inputs do not show.
  Answer answer = Answer::nothing_missing;
  Verdict verdict;  ///< of the last search; candidates in it are numbers of `candidates`, samples those of `searched`
  std::vector<std::string> candidates;
  std::vector<FoundTerm> found;       ///< by falling share; shapes last
  std::vector<Objection> objections;  ///< of which the answer and FoundTerm::confirmed follow
  std::vector<Parameter> parameters;  ///< of the simulation, fitted together with the terms
  Eigen::VectorXd standard_errors;    ///< of those
  std::vector<FittedParameter> fitted_parameters;
  double parameter_gain = 0.0;         ///< of the score, by the free parameters, terms or none beside them
  bool parameters_explain = false;     ///< that gain is beyond chance
  std::vector<Gap> gaps;               ///< d
  Eigen::MatrixXd before;              ///< n x d: the simulation, its own parameters adjusted
  Eigen::MatrixXd corrected;           ///< n x d: with the terms found
  std::vector<Eigen::Index> searched;  ///< rows
  std::vector<Eigen::Index> held_out;  ///< rows
  /// For each row in `held_out` the number of its sample; equal for rows that were averaged.
  std::vector<Eigen::Index> held_out_samples;
  std::vector<Eigen::Index> outliers;  ///< rows that fit nothing and were left out of the fit
  std::vector<UntestableCause> not_testable;
  std::vector<VisibleTerm> visible;  ///< of the causes that were tried, most visible first
  bool floor_from_repeats = false;
  std::vector<Structure> structure;  ///< material; terms found beside it are not confirmed
  std::vector<std::string> notes;    ///< in sentences
  TimeUse time;
  /// n x d, or empty: what the simulated outputs change by where inputs of a motion were smoothed. Gaps include it.
  Eigen::MatrixXd change_by_smoothing;
  /// n x d, or empty: roots of the weights of rows where errors of the inputs make some less certain than others. Gaps,
  /// noise floors and known noise are weighted root mean squares.
  Eigen::MatrixXd weights;
  /// d x 2: the least and the largest that all terms found add together at a row searched or set aside.
  Eigen::MatrixXd range_of_terms;
  Eigen::VectorXd zero_bands;  ///< p, or empty: within them an input is at rest and counts as 0, Inputs::zero_bands
  std::vector<Eigen::Index> failing_rows;  ///< set aside, where the terms make the error grow most; if that failed
  int rounds = 0;
};

/// Whether nothing was found in rows in time, and what is left changes so slowly that they hold fewer than 10 values
/// of it that are independent. A term could not be told from a drift.
bool is_drift(const Missing& missing);

/// Whether what was found is not to be added: it failed on the rows set aside, or the sum of Gap::after^2 / before^2
/// over the outputs is larger than their number, as where a term makes errors of the inputs larger than what it
/// explains.
bool is_worse(const Missing& missing);

/// Whether what was found may be added to a simulation of other rows: the answer is a term, a state or parameters that
/// are off, and not is_worse(). Where it is "unknown" or "undecided", terms and parameters may stand for what is
/// missing; they may be added where they take away more than they leave, sum over the outputs that they change of
/// Gap::after^2 / nominal^2 at most half their number. Not so where the only objection is that other functions explain
/// the rows alike (Reason::rival). Changes of parameters where nothing is missing may not be added.
bool may_be_applied(const Missing& missing);

/// Whether one of the terms found is not certain. Such terms are fitted functions, no laws: several may cancel where
/// they were fitted and nowhere else, so at other rows they add at most what they added there, Missing::range_of_terms.
bool are_terms_held(const Missing& missing);

}  // namespace llmt::discovery
