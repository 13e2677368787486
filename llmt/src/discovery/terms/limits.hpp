// Rows at which a sensor or an actuator is at its limit.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// An output that stays at its largest or smallest value while the simulation goes on.
struct AtLimit {
  std::string output;
  double limit = 0.0;
  bool is_largest = true;
  Eigen::Index rows = 0;
  double simulated = 0.0;  ///< the largest (smallest) simulated value at these rows
};

/// Outputs of at least 20 different values. An end of the measured values is a limit if
///
/// - at least 5 rows and 0.2 % of all have this value exactly, and 5 times as many as have the value next to it (a
///   signal in steps of its resolution also dwells at its ends, but not so);
/// - the simulation is beyond the value at three quarters of these rows: an error would be on both sides;
/// - the value is not 0, where a machine may just stand.
///
/// Marks these rows in `apart`. `simulated` n x d.
std::vector<AtLimit> rows_at_limits(const MeasuredOutputs& measured, const Eigen::MatrixXd& simulated,
                                    std::vector<bool>& apart);

std::vector<std::string> notes_on_limits(const std::vector<AtLimit>& limits);

}  // namespace llmt::discovery
