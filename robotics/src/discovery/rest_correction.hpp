// A correction by trees of the residuals that the improved robot leaves.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "llmt/progress.hpp"
#include "llmt/robotics/correction.hpp"

namespace llmt::robotics {

/// Adds a correction by trees to the robot if it lowers the error on poses left out by more than two standard errors.
/// The outcome is noted in a sentence. Fewer than 100 poses: does nothing. `work` is that of the
/// discovery.
void add_correction(const Measurements& searched, std::uint64_t seed, Work& work, CorrectedRobot& improved,
                    std::vector<std::string>& notes);

}  // namespace llmt::robotics
