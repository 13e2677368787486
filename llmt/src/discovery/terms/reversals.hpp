// Rows near the reversals of a motion at which nothing explains the deviations.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Rows set apart because |speed| < limit.
struct Reversals {
  std::string speed;
  double limit = 0.0;
  Eigen::Index rows = 0;
  double ratio = 0.0;  ///< root mean square of what is left there, in units of that at the faster half of the rows
};

/// For rows in time. Where a machine reverses, filters round the jump of its friction, it sticks, and the sign of its
/// speed is uncertain: deviations there follow no law of the inputs at the same row. The rows that `missing` used, but
/// for its outliers, are sorted by |speed| of each motion among the inputs, and looked at in bins of a fortieth. The
/// slowest bins are reversals as far as their mean square is at least 2 times that of the faster half; at most 30 % of
/// the rows. They are set apart if their mean square is at least 3 times as large, and if at least 15 % of them, and 4,
/// are larger than 2 standard deviations of the faster half, unless confirmed terms explain 85 % of the squares there.
/// Marks them in `apart`.
std::vector<Reversals> left_at_reversals(const Inputs& inputs, const MeasuredOutputs& measured, const Missing& missing,
                                         std::vector<bool>& apart);

std::vector<std::string> notes_on_reversals(const std::vector<Reversals>& reversals);

}  // namespace llmt::discovery
