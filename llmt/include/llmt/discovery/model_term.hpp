/// \file
/// A term that a simulation may lack, and the inputs that it is a function of.
///
///     llmt::discovery::Inputs named{{"x", "v"}, inputs};  // a column each
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt::discovery {

/// What the columns of a term are computed from.
struct Rows {
  Eigen::MatrixXd inputs;              ///< n x p
  Eigen::VectorXd simulated;           ///< n: the output that the term is to change, without any term
  std::vector<Eigen::Index> sequence;  ///< n: the rows in the order in which they were taken
  Eigen::VectorXd instants;            ///< n: when each row was taken, or its number; falls where a new run begins
};

/// An unknown inside a term, such as a time constant: tried at all these values, the best of which competes.
struct TermConstant {
  std::string name;
  std::string unit;
  std::vector<double> tried;  ///< ascending, at least one
  bool smooth = true;         ///< the term is differentiable by it: it is fitted with everything else afterwards
  int kept = 1;               ///< number of the best values that compete
  int most = 1;               ///< largest number of values used at once; more would approximate another function
  /// Powers 0 ... `beyond` of the first input of ModelTerm::inputs are projected out before values are compared, so
  /// that no value is preferred for a part that simpler terms explain.
  int beyond = 0;
  /// It is the width of a step or a peak of the first input. What is narrower than the errors of that input cannot be
  /// seen, see find_missing().
  bool width = false;
};

/// One candidate: output += columns(rows, constants) * coefficients.
struct ModelTerm {
  std::string family;                     ///< the cause, "square"; variants of one cause share it
  std::string location;                   ///< where, "a"; a family is used at most once at a location
  std::string formula;                    ///< for people: "a^2"
  std::vector<std::string> inputs;        ///< what it depends on
  std::vector<std::string> coefficients;  ///< k names
  /// The coefficients are 1 and are not fitted; its constants are its unknowns, as of a delay: s(t - delay) - s(t).
  bool whole = false;
  std::string per = {};  ///< a coefficient is in units of the output by this, "a^2"; empty: in those of the output
  /// n x k. Called as Simulation::predict is.
  std::function<Eigen::MatrixXd(const Rows& rows, const Eigen::VectorXd& constants)> columns;
  std::vector<TermConstant> constants = {};  ///< at most two; of two, the first is smooth
  std::string output = {};                   ///< the output it changes; empty: each output is a place of its own
  bool generic = false;  ///< not a cause but a shape: what it explains is "unknown, depends on `inputs`"
  bool history = false;  ///< depends on earlier rows: tried only beside what rows explain by themselves
  /// "a delay or a first-order lag": the term stands for a state that the inputs do not show. Empty: it does not.
  std::string inner_state = {};
  std::string shown_by = {};  ///< the signal that would show that state
  /// The input beyond whose threshold, the last constant, the term acts, and is zero elsewhere. Tried only where the
  /// other terms leave something. Empty: it acts everywhere.
  std::string regime = {};
  std::string unit = {};       ///< of the first coefficient; empty: that of the output by `per`, of all
  Eigen::VectorXd lower = {};  ///< k plausible limits of the coefficients, or empty: none
  Eigen::VectorXd upper = {};
  /// Where terms predict the same at every row, the less complex one gets the name. The library's have 1 (a constant)
  /// to 11 (the value of the row before).
  int complexity = 0;
  /// Added to the score: how much better a term must explain that contains simpler ones or comes close to them.
  double prior_cost = 0.0;
  /// k expressions, one for each column, in the language of muParser: $1 and $2 stand for `inputs`, $c to $e
  /// for the constants, $s for the simulated output. Empty: there are none, as for terms of the row before.
  std::vector<std::string> code = {};
};

/// Inputs that terms are made of.
struct Inputs {
  std::vector<std::string> names;  ///< p
  Eigen::MatrixXd values;          ///< n x p
  std::string order = {};          ///< the input that says in which order rows were taken; empty: as they stand
  /// n: when each row was taken, where rows are values of signals in time, whose noise may be alike in neighbours.
  /// Empty: rows are independent.
  Eigen::VectorXd instants = {};
  std::vector<Eigen::Index> runs = {};  ///< n labels of the recording that a row is of; empty: one recording
  /// p standard deviations of the errors of the inputs (0: none; NaN: estimated from rows in time). Empty: NaN for rows
  /// in time, else 0.
  Eigen::VectorXd noise = {};
  /// Of the low pass of signals() that the measured outputs went through, per unit of the instants; the simulation and
  /// the terms then go through it too, which needs rows at even steps of at most half of an independent one. 0: none.
  double cutoff = 0.0;
  /// p zero bands: where |x| is below, the input is at rest and counts as 0 in terms (Karnopp 1985). Empty: none; for
  /// rows in time find_missing() looks for them.
  Eigen::VectorXd zero_bands = {};
};

}  // namespace llmt::discovery
