// Terms of the same inputs that together stand for another function of them.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

std::vector<std::string> sorted_inputs(const FoundTerm& found);

/// Of each term found, whether it and others may only approximate one that was not tried: three or more kinds of one
/// input (in time, two of which one has a rival of that input), or two terms of the same two inputs. A term for which
/// an offset could stand counts, in time, as one of each input of which a function could stand for it too.
std::vector<bool> approximations(const std::vector<FoundTerm>& all, bool in_time);

}  // namespace llmt::discovery
