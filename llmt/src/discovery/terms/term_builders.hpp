// The parts that the library's terms are made of.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "discovery/recording/recording.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Fewer values of an input do not tell a constant that is searched.
inline constexpr std::size_t fewest_values_of_a_search = 8;
/// With more inputs the choice among pairs of them that are no products would cost every term evidence.
inline constexpr std::size_t most_inputs_of_pairs = 8;

/// One input as terms see it.
struct InputView {
  Eigen::Index column = 0;
  std::string name;
  double low = 0.0;
  double high = 0.0;
  std::vector<double> distinct;  // ascending

  double range() const { return high - low; }
};

/// Coefficient times function(value of one input). `code` is its ModelTerm::code.
ModelTerm function_term(const InputView& input, std::string family, std::string formula, std::string per,
                        double (*function)(double), std::string code);

/// Coefficients times columns that depend on one input and a constant that is searched; `code` is their
/// ModelTerm::code.
ModelTerm searched_term(const InputView& input, std::string family, std::string formula,
                        std::vector<std::string> coefficients, std::string per, TermConstant constant,
                        std::function<Eigen::MatrixXd(const Eigen::ArrayXd& x, double constant)> columns,
                        std::vector<std::string> code);

/// Shapes that carry "unknown".
std::vector<ModelTerm> shapes_of(const std::vector<InputView>& inputs);

/// Terms with a constant that is searched, of one input.
std::vector<ModelTerm> searched_terms(const InputView& input);

/// Laws of one input that contain simpler terms: sigmoid, Hill's law, powers, Coulomb's and Stribeck's friction, a
/// limit on both sides, a dead band.
std::vector<ModelTerm> law_terms(const InputView& input);

/// Friction that grows with the simulated output or with another input.
std::vector<ModelTerm> load_frictions(const std::vector<InputView>& inputs);

/// Terms of the row before, of inputs of at least three values.
std::vector<ModelTerm> sequence_terms(const InputView& input, const std::string& order);

/// Midpoints between neighbouring values with at least `beyond` values on both sides, at most `count`.
std::vector<double> thresholds(const std::vector<double>& distinct, std::size_t beyond, std::size_t count);

/// At the rows in time, s - H s of a signal s (n), where H(p) = (2 zeta w p + w^2) / (p^2 + 2 zeta w p + w^2),
/// p = d/dt, w = 2 pi frequency, is how a load behind a spring and damper follows: from rest at the beginning of a
/// recording, exact for a signal that is a straight line between rows. An interruption of up to one period, as where
/// rows were left out, is bridged by such a line. 0 < damping < 1.
Eigen::VectorXd resonant_part(const Rows& rows, const Eigen::VectorXd& signal, double frequency, double damping);

/// Frequencies, per unit of the instants, that may be told from those of the motion: from that of a sine which changes
/// as fast as the simulated output up to one period in three rows, in ratios of 1.08 or more; at most 40. Empty: there
/// is none.
std::vector<double> resonant_frequencies(const Rows& rows);

/// Frequency and damping ratio of a term that rings.
std::vector<TermConstant> constants_of_ringing(std::vector<double> frequencies);

/// What such a term makes of a signal: H s - s, see resonant_part(), at these constants. More damping than a fifth is a
/// filter: it hardly rings.
Eigen::VectorXd ringing(const Rows& rows, const Eigen::VectorXd& signal, const Eigen::VectorXd& constants);

/// At the rows in time, the first-order lag of a signal x (n): tau dz/dt = x - z; with every run z begins at x, or at 0
/// where it does not start settled; exact for a signal that is a straight line between rows; rows left out are bridged
/// by such lines.
Eigen::VectorXd lagged(const Rows& rows, const Eigen::VectorXd& signal, double tau, bool starts_settled);

/// For an output of rows in time, n x d `simulated`: its lag or lead by a time of its own; and of every input x what a
/// first-order lag with the time constant tau makes of it: x - lag x (creep, a second vessel or mass behind it), x lag
/// x^2 and lag x^2 (heat of its losses, from 0 at the beginning); and, for speeds and accelerations, H x - x (a load
/// that swings, see resonant_part()).
std::vector<ModelTerm> memory_terms(const Recording& recording, const std::string& output);

}  // namespace llmt::discovery
