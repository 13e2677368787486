// A tree of what the improved robot leaves over.
#pragma once

#include <cstdint>

#include "llmt/progress.hpp"
#include "llmt/robotics/discovery_result.hpp"

namespace llmt::robotics {

/// A tree of what the improved robot leaves, kept if it lowers the error of poses left out by more than two standard
/// errors. `work`: of the discovery.
void correct_rest(const Measurements& searched, std::uint64_t seed, Work& work, Discovery& result);

}  // namespace llmt::robotics
