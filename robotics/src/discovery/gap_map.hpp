// Where simulation and measurement disagree: a tree of the residual.
#pragma once

#include "llmt/robotics/discovery_result.hpp"

namespace llmt::robotics {

/// Where the gap of `before` is (step "locate").
void locate(const Measurements& searched, Discovery& result);

}  // namespace llmt::robotics
