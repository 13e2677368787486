/// \file
/// What 45 poses of a TX200-like arm can tell: the paper's section 10 in simulation, where the truth is known.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "llmt/robotics/calibration_report.hpp"

namespace llmt::apps {

/// Mean position errors over 45 poses, mm.
struct Tx200Trial {
  double geometric_in_sample = 0.0;
  double corrected_in_sample = 0.0;
  double geometric_held_out = 0.0;  ///< leave one pose out: geometry and trees fitted to the other 44
  double corrected_held_out = 0.0;
};

/// One simulated data set and what was made of it.
struct Tx200Run {
  robotics::Measurements measurements;
  robotics::CalibrationReport report;
};

/// The run of one seed, see tx200_study().
Tx200Run tx200_run(bool compliance, std::uint64_t seed);

/// 45 poses with 10 um noise; with `compliance`, the compliance of axes 2 and 3 bends the simulated arm and no model
/// knows of it. Five linear models of seven coefficients per axis, as in the paper. One trial for each of `seeds` seeds
/// from `first_seed` on.
std::vector<Tx200Trial> tx200_study(bool compliance, std::uint64_t first_seed, int seeds,
                                    const std::function<void(int done)>& progress);

}  // namespace llmt::apps
