/// \file
/// Terms that a simulation may lack, as functions of its named inputs.
///
///     std::vector<llmt::discovery::ModelTerm> terms = llmt::discovery::standard_terms(named);
///     terms.push_back(llmt::discovery::own_term("drag", "v |v|", [](const Eigen::VectorXd& row) {
///       return row(1) * std::abs(row(1));
///     }));
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/model_term.hpp"
#include "llmt/discovery/verdict.hpp"

namespace llmt::discovery {

/// The terms of the families `only` (empty: of all), without those of the families `without`. Shapes stay.
/// Throws std::invalid_argument for a family that none of the terms has, naming those that there are.
std::vector<ModelTerm> of_families(std::vector<ModelTerm> terms, const std::vector<std::string>& only,
                                   const std::vector<std::string>& without);

/// A term of the user's own: coefficient * function(inputs of a row).
ModelTerm own_term(std::string name, std::string formula, std::function<double(const Eigen::VectorXd& row)> function);

/// The library of terms, for inputs x, x':
///   offset 1; gain s and gain_curvature s^2 of the simulated output s;
///   linear x; square x^2; cube x^3; product x x'; square_product x^2 x' (up to 8 inputs); root sqrt(x); log ln(x);
///   reciprocal 1/x;
///   absolute |x|; sign sgn(x); signed_square x |x|;
///   harmonic1, harmonic2: cos(h x), sin(h x) for inputs named *_deg or *_rad, or as joint angles are (q, theta, phi,
///   psi, angle, joint, with or without a number, *_angle) with a range of 1 to 4 pi;
///   wave cos(2 pi x / P), sin(2 pi x / P), the period P searched;
///   step [x > c], hinge max(0, x - c), hinge_below max(0, c - x), the threshold c searched;
///   settling exp(-(x - smallest x) / tau), tau searched; saturation x / (c + x), c searched;
///   tanh tanh(x/c), asinh asinh(x/c), stribeck sgn(x) exp(-(x/c)^2), c searched, of inputs that change sign;
///   coulomb_stribeck sgn(x) (F_c + F_x exp(-(x/c)^2)), load_friction sgn(x) |s|, sign_product sgn(x) |x'|, of inputs x
///   that change sign; power x^p, hill x^n / (c^n + x^n) or c^n / (c^n + x^n), of inputs that
///   are never negative; sigmoid 1 / (1 + exp(-(x - c) / w)) or 1 / (1 + exp((x - c) / w)); c, p, n, w searched;
///   previous x_before; rate (x - x_before) / (step of order); direction: the sign of the last change of x;
/// and shapes that carry "unknown": ?smooth (5 cosines over the range of x), ?fine (12), ?bump (a place searched, three
/// widths), ?pair (10 products of cosines in x and x').
///
/// A term that equals a simpler one at these values is left out: x^2 for an input of two values, |x| for one sign.
/// Constant inputs go to `untestable` if that is given. Throws std::invalid_argument for wrong shapes, empty or
/// repeated names, values or instants that are not finite, instants or runs of other than n rows, and an order that is
/// not an input or holds equal values.
std::vector<ModelTerm> standard_terms(const Inputs& inputs, std::vector<UntestableCause>* untestable = nullptr);

/// The terms of the row before of one input: previous, rate, direction. Throws as standard_terms(), and for an input
/// that there is not.
std::vector<ModelTerm> row_before_terms(const Inputs& inputs, const std::string& input);
/// Terms that stand for a state which the inputs do not show, for rows in the order of time (Rows::instants):
///   delay s(t - delay) - s(t) of the simulated output s, of either sign: a command comes before the torque. A
///   first-order lag s = y + delay dy/dt is the same to first order. It has no coefficient (ModelTerm::whole);
///   drive_spring, for inputs that are a position q, its speed v and its acceleration a (found out): the inputs are
///   measured in front of a spring of rate k, and the load is at q - w/k, where w = y - J a - b v is what the spring
///   carries, J and b the inertia and damping in front of it. To first order, for which y is s,
///   y - s = -(1/k) (ds/dq w + (ds/da - J) d2w/dt2), with three free coefficients: compliance 1/k, inertia J/k, damping
///   b/k.
///   resonance -share (s - H s), H(p) = (2 zeta w p + w^2) / (p^2 + 2 zeta w p + w^2), p = d/dt, w = 2 pi frequency:
///   this share of the simulated output moves a load behind a spring and damper, which rings. Frequency and damping
///   ratio zeta are searched, zeta below 0.16: what is damped more is rather a filter; the frequency up to
///   Inputs::cutoff. Exact for a signal that is a straight line between rows.
///   resonance x   (H - 1) x of a speed or an acceleration x: a load that swings, from a tenth of the frequency of the
///   motion to twice as much.
///   lag           z - s, tau dz/dt = s - z; for a negative tau -tau ds/dt, the command of a slow actuator.
///   memory x, warming x, warmth x: x - lag x, x lag x^2, lag x^2 of every input x, where tau d(lag)/dt = x - lag
///   (x^2 - lag); lag x begins at x, lag x^2 at 0, with every run. Time constants tau up to the length of a run.
/// Derivatives by time are those of local polynomials; ds/dq and ds/da are those of a function that is fitted to the
/// table. `simulated` n x d. Empty for less than 60 rows. Throws as standard_terms().
std::vector<ModelTerm> inner_state_terms(const Inputs& inputs, const Eigen::MatrixXd& simulated,
                                         const std::vector<std::string>& outputs);

/// Effects that act in a regime alone: each term of `library` with at most one constant of its own (none, where it is
/// a function of x), times [x > c] or [x <= c] for every input x; the threshold c is searched, first among 20
/// quantiles. Location: "q where x > c".
std::vector<ModelTerm> regime_terms(const Inputs& inputs, const std::vector<ModelTerm>& library);

/// `library` without the terms of one column that are proportional to one of `own`, so that the user's name is used.
std::vector<ModelTerm> without_duplicates(std::vector<ModelTerm> library, const std::vector<ModelTerm>& own,
                                          const Rows& rows);

/// The rows on which terms of these inputs are evaluated. `simulated` has n values. Throws as standard_terms().
Rows rows_of(const Inputs& inputs, const Eigen::VectorXd& simulated);

}  // namespace llmt::discovery
