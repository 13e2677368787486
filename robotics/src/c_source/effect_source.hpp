// Effects as statements of C.
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

/// The statement that adds an effect to more[j], the change of its joint's value; `conditions` are the columns that C
/// takes. Throws std::invalid_argument with the effect and the reason if its type has no expression in C.
std::string effect_statement(const Chain& chain, const Effect& effect, const std::vector<std::string>& conditions);

/// The column of the first name of "a|b" that suits the joint.
std::string condition_of(const Chain& chain, std::size_t joint, const std::string& names);

}  // namespace llmt::robotics
