/// \file
/// Effects that were found, in the words of a person.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "llmt/robotics/discovery/discovery_result.hpp"

namespace llmt::report {

/// A value with its error in the unit that needs no exponent: 1.1e-6 rad/(N m) is 1.10 +- 0.05 urad/(N m).
std::string with_unit(double value, double error, const std::string& unit);

/// "43 to 46 urad/(N m)".
std::string range_with_unit(double low, double high, const std::string& unit);

/// "joint2", "the whole arm".
std::string place_of(const robotics::FoundEffect& effect);

/// " (order 202)", or nothing.
std::string constants_of(const robotics::FoundEffect& effect);

/// The smallest sizes that would have been found nine times in ten, of one effect over its places.
struct VisibleRange {
  double best_place = 0.0;
  double worst_place = 0.0;
  std::string unit;  ///< empty: a pure number
};

struct VisibleSizes {
  std::map<std::string, VisibleRange> ranges;  ///< by the effect's type
  std::set<std::string> never;                 ///< types that would not have been found at any plausible size
};
VisibleSizes visible_sizes(const robotics::Discovery& found);

/// What was found, what moves the tool most first.
std::vector<const robotics::FoundEffect*> by_size(const robotics::Discovery& found);

/// "link bending, joint2", with the effect's constants: what it is, for people.
std::string effect_words(const robotics::Effect& effect);

/// A parameter, or the owner of several, as the robot's calibration calls it, in the same words: "joint2.theta",
/// "tool", "link bending, joint2: flexibility".
std::string parameter_words(const robotics::Robot& robot, const std::string& name);

/// The larger effect that this one, found beside it, is a part of: the same cause at the same place with another
/// constant, but for waves, whose orders are causes of their own. The effect itself where there is none.
const robotics::FoundEffect& whole_of(const robotics::Discovery& found, const robotics::FoundEffect& effect);

/// The k-th rival of an effect in the same words; several causes at once are joined by "together with".
std::string rival_words(const robotics::FoundEffect& effect, std::size_t k);

/// "a smooth function of q1": what a pattern looks like.
std::string pattern_words(const robotics::ErrorPattern& pattern);

}  // namespace llmt::report
