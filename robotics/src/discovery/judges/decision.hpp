// The answer of a discovery, decided in one place from the verdict of the search and the objections to it.
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/discovery/discovery_result.hpp"

namespace llmt::robotics {

/// Reasons not to take a verdict or a name as the search gave it.
enum class Reason {
  // Against the verdict.
  gross_errors,          ///< too many measurements fit nothing
  structured_residuals,  ///< the residuals are not an instrument's noise, and no name that stands explains that
  harmonics,             ///< a wave has harmonics that a gear's wave has not
  worse_fit,             ///< fitted with what was found, the robot misses more than without it
  held_out_loss,         ///< what was found does not make the poses set aside better; speaks against every name
  // Against single names only.
  undetermined,          ///< all values are within two standard errors of zero, or not known
  part_of_unknown,       ///< the name may be a part of what has no name
  error_of_larger,       ///< a small effect that may be the error of a large one
  instrument_residuals,  ///< the residuals are like an instrument's errors, whose image an effect of the arm may be
  still_joint,           ///< an effect of a joint that stands still
  both_signs,            ///< compliances of both signs in one arm
  arm_instead,           ///< an instrument's error, where errors of the arm alone explain the poses set aside as well
  refits,                ///< it does not hold in four of five refits that leave out a fifth of the poses each
};

/// The result of a judge.
struct Objection {
  Reason reason;
  std::vector<std::size_t> names = {};     ///< numbers of the names that it speaks against
  std::vector<FoundPattern> unknown = {};  ///< what is missing instead
  std::vector<std::string> notes = {};     ///< for Discovery::notes
};

/// An effect that a search named.
struct Name {
  FoundEffect effect;         ///< not yet confirmed
  double family_share = 0.0;  ///< of the explained sum of squares that goes with all places of its family
};

/// True for every name that no objection speaks against.
std::vector<bool> unopposed(const std::vector<Objection>& objections, std::size_t names);

struct Decision {
  discovery::Answer answer;
  Headline headline;
  std::vector<bool> confirmed;  ///< one for each name
};

/// A name is confirmed if no objection speaks against it. Answer and headline are those of the first row of the table
/// in docs/discovery.md ("The answer") that applies.
Decision decide(discovery::Answer verdict, const std::vector<Objection>& objections, const std::vector<Name>& names);

}  // namespace llmt::robotics
