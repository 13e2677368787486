// Effects as statements of C.
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/robot.hpp"

namespace llmt::robotics {

/// Whether and how an effect is added to more[j], the change of its joint's value; `conditions` are the columns that C
/// takes. Throws std::invalid_argument naming the effect if it is no change of a joint's value.
std::string effect_statement(const Chain& chain, const Effect& effect, const std::vector<std::string>& conditions);

/// A number as C reads it back exactly.
std::string c_number(double value);

/// The column of the first name of "a|b" that suits the joint.
std::string condition_of(const Chain& chain, std::size_t joint, const std::string& names);

}  // namespace llmt::robotics
