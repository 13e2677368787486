/// \file
/// Which terms a simulation lacks: any function of named inputs and parameters, measured outputs, and terms to try.
///
///     const std::vector<llmt::discovery::ModelTerm> terms = llmt::discovery::standard_terms(named);
///     const llmt::discovery::MeasuredOutputs force{{"force"}, outputs};
///     const llmt::discovery::Missing missing = llmt::discovery::find_missing(spring, named, force, terms);
///     for (const llmt::discovery::FoundTerm& found : missing.found) std::puts(found.formula.c_str());
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "llmt/abi.hpp"
#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/search.hpp"
#include "llmt/discovery/terms.hpp"

namespace llmt::discovery {

/// A simulation that is known only as a table of its outputs (n x d) at the measured rows. With `offset` or `scale` it
/// may adjust  output = offset + scale * table  for each output; without them it is fixed.
Simulation tabulated(const Eigen::MatrixXd& simulated, const std::vector<std::string>& outputs, bool offset = false,
                     bool scale = false);

/// A simulation that also moves along given derivatives: its outputs at its own parameters, plus the sum over
/// `parameters` of (value - nominal value) * derivatives (n x d each), at the rows that the derivatives were taken at.
/// The scale of each parameter is set to what changes an output by a hundredth of its spread. Throws
/// std::invalid_argument for a parameter whose name is empty or there twice, and for derivatives of another shape or
/// that are not finite.
Simulation linearised(Simulation simulation, const Eigen::MatrixXd& simulated, std::vector<Parameter> parameters,
                      std::vector<Eigen::MatrixXd> derivatives);

/// Finds which of the terms the simulation lacks, and how large they are.
///
/// 1. A share of the rows is set aside. Steps 2 to 5 use the other rows.
/// 2. The free parameters of the simulation are fitted. Of those whose derivatives depend on each other linearly, the
///    later ones are kept at their values, and the first ones stand for the sums (FittedParameter::name).
/// 3. search() explains the residuals; constants of terms are tried at the present estimates.
/// 4. Parameters, coefficients and smooth constants of what was found are fitted together (solve()).
/// 5. Steps 3 and 4 are repeated at the new estimates, where what was found competes again, until the found set stays
///    the same. Of several outputs, each is weighted by the inverse of the scatter that is left of it.
/// 6. The errors on the rows set aside are computed, once. A term that does not shrink them is not confirmed. If all
///    terms together make them larger, the terms that do it are refuted, and the steps are repeated without them and
///    with other rows set aside. If the third search fails too, in time the fourth, the answer is failed_held_out.
///
/// Terms that depend on earlier rows (ModelTerm::history) are tried after the others have been found, and stay where
/// they explain better by SearchOptions::rival_margin.
///
/// **Rows in time** (Inputs::instants). Samples are means over blocks of consecutive rows, of the outputs, the
/// simulation and every term alike: the equation is linear in them, so nothing is rounded off (parallel filtering and
/// decimation, Gautier 1997). Blocks are as long as the inputs bear. Whole runs, or stretches of consecutive rows, are
/// set aside. The correlation of what is left is measured after each round; scores count the share of samples that is
/// independent, the null of random signs flips clusters of samples, and standard errors are inflated by
/// 1 + 2 sum_k rho_k r_k (Bartlett 1935). Without instants, rows whose inputs are smooth along the table are taken for
/// rows in time (TimeUse::found_out) where the inputs are noisy, where there are more than `largest_sample`, or where
/// what is left is alike in neighbours.
///
/// **Filtered rows** (Inputs::cutoff). Simulation, derivatives and terms go through the low pass that the measured
/// outputs went through, and samples are rows as far apart as its noise is independent.
///
/// When the verdict stands, everything is fitted once more on all rows. Terms of regimes (ModelTerm::regime) are tried
/// where the others leave something. With MeasuredOutputs::noise, the answer is undecided where nothing was found and
/// more than 5 times the known noise is left; terms beside so much are not confirmed. It is undecided, too, where
/// functions that differ from what was found by more than a tenth explain these rows alike.
///
/// The answer is parameters_only where nothing is missing and k free parameters gain, with n values of each output o,
///   sum_o n ln(RSS_o at the nominal values / RSS_o fitted) - k ln(n d) > 0,
/// and a likelihood ratio as large as theirs has a probability below SearchOptions::false_alarm_rate in noise, and the
/// rows set aside are not worse with them.
///
/// Throws std::invalid_argument for wrong shapes, names or options, values that are not finite, too few rows, inputs
/// that determine a measured output exactly while they do not determine the simulation (it names them), and a
/// prediction or a term that has the wrong shape or is not finite, naming it. Throws RandomSimulation where two runs at
/// the nominal values differ by more than a billionth.
Missing find_missing(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
                     const std::vector<ModelTerm>& terms, const MissingOptions& options = {});

/// Derivatives of the outputs by all parameters, one n x d matrix each, at inputs and values of the parameters.
using OutputDerivatives =
    std::function<std::vector<Eigen::MatrixXd>(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values)>;

/// Central differences of the simulation's outputs, with a hundredth of each parameter's scale to both sides: two calls
/// for each parameter. Larger steps than rounding asks for, because outputs may be written with six digits. Holds a
/// copy of the simulation.
OutputDerivatives central_differences(Simulation simulation);

/// find_missing() for a simulation that knows its derivatives, or that is worth few calls. It is linearised at the
/// parameters, find_missing() searches and fits, and the simulation is linearised again at the new values
/// (Gauss-Newton), until they move by less than a twentieth of their standard errors, or the simulation turns out
/// to be linear in them, as a rigid body is in its masses. A step that makes the sum of squares of what is left
/// grow is halved. The errors before and after are those of the simulation itself.
///
/// Throws as find_missing(), and for derivatives of another number or shape, or that are not finite.
Missing find_missing_in_steps(const Simulation& simulation, const OutputDerivatives& derivatives, const Inputs& inputs,
                              const MeasuredOutputs& measured, const std::vector<ModelTerm>& terms,
                              const MissingOptions& options = {});

/// The simulation with what was found, at other inputs; m x d. `terms` as given to find_missing(). If one of the terms
/// found is not certain, what they add together is held to Missing::range_of_terms.
Eigen::MatrixXd corrected(const Simulation& simulation, const Missing& missing, const std::vector<ModelTerm>& terms,
                          const Inputs& inputs);

}  // namespace llmt::discovery
