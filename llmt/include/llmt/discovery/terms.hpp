/// \file
/// Terms that a simulation may lack, as functions of its named inputs.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/search.hpp"

namespace llmt::discovery {

/// What the columns of a term are computed from.
struct Rows {
  Eigen::MatrixXd inputs;              ///< n x p
  Eigen::VectorXd simulated;           ///< n: the output that the term is to change, without any term
  std::vector<Eigen::Index> sequence;  ///< n: the rows in the order in which they were taken
  Eigen::VectorXd instants;            ///< n: when each row was taken, or its number
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
};

/// One candidate: output += columns(rows, constants) * coefficients.
struct ModelTerm {
  std::string family;                     ///< the cause, "square"; variants of one cause share it
  std::string location;                   ///< where, "a"; a family is used at most once at a location
  std::string formula;                    ///< for people: "a^2"
  std::vector<std::string> inputs;        ///< what it depends on
  std::vector<std::string> coefficients;  ///< k names
  std::string per = {};  ///< a coefficient is in units of the output by this, "a^2"; empty: in those of the output
  std::function<Eigen::MatrixXd(const Rows& rows, const Eigen::VectorXd& constants)> columns;  ///< n x k
  std::vector<TermConstant> constants = {};                                                    ///< at most one
  std::string output = {};     ///< the output it changes; empty: each output is a place of its own
  bool generic = false;        ///< not a cause but a shape: what it explains is "unknown, depends on `inputs`"
  Eigen::VectorXd lower = {};  ///< k plausible limits of the coefficients, or empty: none
  Eigen::VectorXd upper = {};
};

/// A term of the user's own: coefficient * function(inputs of a row).
ModelTerm own_term(std::string name, std::string formula, std::function<double(const Eigen::VectorXd& row)> function);

/// Inputs that terms are made of.
struct Inputs {
  std::vector<std::string> names;  ///< p
  Eigen::MatrixXd values;          ///< n x p
  std::string order = {};          ///< the input that says in which order rows were taken; empty: as they stand
};

/// The library of terms, for inputs x, x':
///   offset 1; gain s and gain_curvature s^2 of the simulated output s;
///   linear x; square x^2; cube x^3; product x x'; absolute |x|; sign sgn(x);
///   harmonic1, harmonic2: cos(h x), sin(h x) for inputs named *_deg or *_rad;
///   wave cos(2 pi x / P), sin(2 pi x / P), the period P searched;
///   step [x > c] and hinge max(0, x - c), the threshold c searched;
///   settling exp(-(x - smallest x) / tau), tau searched;
///   previous x_before; rate (x - x_before) / (step of order); direction: the sign of the last change of x;
/// and shapes that carry "unknown": ?smooth (5 cosines over the range of x), ?fine (12), ?bump (a place searched, three
/// widths), ?pair (10 products of cosines in x and x').
///
/// A term that equals a simpler one at these values is left out: x^2 for an input of two values, |x| for one sign.
/// Constant inputs go to `untestable` if that is given. Throws std::invalid_argument for wrong shapes, empty or
/// repeated names, values that are not finite, and an order that is not an input or holds equal values.
std::vector<ModelTerm> standard_terms(const Inputs& inputs, std::vector<UntestableCause>* untestable = nullptr);

/// `library` without the terms of one column that are proportional to one of `own`: the user's name for it wins.
std::vector<ModelTerm> without_duplicates(std::vector<ModelTerm> library, const std::vector<ModelTerm>& own,
                                          const Rows& rows);

/// What the terms of these inputs are evaluated on. `simulated` has a value per row. Throws as standard_terms().
Rows rows_of(const Inputs& inputs, const Eigen::VectorXd& simulated);

}  // namespace llmt::discovery
