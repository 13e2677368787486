/// \file
/// Which terms a simulation lacks: any function of named inputs and parameters, measured outputs, and terms to try.
///
///     const std::vector<llmt::discovery::ModelTerm> terms = llmt::discovery::standard_terms(named);
///     const llmt::discovery::MeasuredOutputs force{{"force"}, outputs};
///     const llmt::discovery::Missing missing = llmt::discovery::find_missing(spring, named, force, terms);
///     for (const llmt::discovery::FoundTerm& found : missing.found) std::puts(found.formula.c_str());
#pragma once

#include <Eigen/Core>
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

/// Finds which of the terms the simulation lacks, and how large they are.
///
/// 1. A share of the rows is set aside. Steps 2 to 5 use the other rows.
/// 2. The free parameters of the simulation are fitted.
/// 3. search() explains the residuals; constants of terms are tried at the present estimates.
/// 4. Parameters, coefficients and smooth constants of what was found are fitted together (solve()).
/// 5. Steps 3 and 4 are repeated at the new estimates, where what was found competes again, until the found set stays
///    the same. Of several outputs, each is weighted by the inverse of the scatter that is left of it.
/// 6. The errors on the rows set aside are computed, once. A term that does not shrink them is not confirmed. If all
///    terms together make them larger, the terms that do it are refuted, and the steps are repeated without them and
///    with other rows set aside; after the third failure the answer is failed_held_out.
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
/// Throws std::invalid_argument for wrong shapes, names or options, values that are not finite, too few rows, inputs
/// that determine a measured output exactly while they do not determine the simulation (it names them), and a
/// prediction or a term that has the wrong shape or is not finite, naming it.
Missing find_missing(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
                     const std::vector<ModelTerm>& terms, const MissingOptions& options = {});

/// The simulation with what was found, at other inputs; m x d. `terms` as given to find_missing().
Eigen::MatrixXd corrected(const Simulation& simulation, const Missing& missing, const std::vector<ModelTerm>& terms,
                          const Inputs& inputs);

}  // namespace llmt::discovery
