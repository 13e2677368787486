// What a load behind a spring takes off a signal that moves it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// At the rows in time, s - H s of a signal s (n), where H(p) = (2 zeta w p + w^2) / (p^2 + 2 zeta w p + w^2),
/// p = d/dt, w = 2 pi frequency, is how a load behind a spring and damper follows: from rest at the beginning of a
/// recording, exact for a signal that is a straight line between rows. An interruption of up to one period, as where
/// rows were left out, is bridged by such a line. 0 < damping < 1.
Eigen::VectorXd resonant_part(const Rows& rows, const Eigen::VectorXd& signal, double frequency, double damping);

/// Frequencies, per unit of the instants, that may be told from those of the motion: from that of a sine which changes
/// as fast as the simulated output up to one period in three rows, in ratios of 1.08 or more; at most 40. Empty: there
/// is none.
std::vector<double> resonant_frequencies(const Rows& rows);

}  // namespace llmt::discovery
