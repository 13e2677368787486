/// \file
/// The effects of a discovery in one sentence for each kind.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "llmt/robotics/discovery/discovery.hpp"

namespace llmt::report {

/// Columns of the page of a discovery.
inline constexpr std::size_t most_columns = 100;

/// "joint1, joint3 and joint4"
std::string list_of(const std::vector<std::string>& names);

/// One line for all places of one kind of effect, what moves the tool most first.
std::vector<std::string> effect_sentences(const robotics::Discovery& found);

}  // namespace llmt::report
