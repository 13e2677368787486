// Terms of states that follow the inputs slowly, or swing behind them.
#pragma once

#include <string>
#include <vector>

#include "discovery/recording/recording.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

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
