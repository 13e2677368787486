// Constants of effects that the search chose from a grid, fitted.
#pragma once

#include <map>
#include <string>

#include "discovery/investigation/investigation.hpp"

namespace llmt::robotics {

/// Fits the presliding of every hysteresis, and the order of every transmission error that was looked for in the
/// residuals, together with everything else. The values of these effects get the standard errors of that fit, which
/// count that the constant is estimated as well. A whole order stays. The effects have new labels then, in `also` too.
/// Returns the standard errors of the constants by the label of their effect.
std::map<std::string, double> fit_constants(Investigation& investigation, const DiscoveryOptions& options,
                                            std::vector<Hypothesis>* also);

}  // namespace llmt::robotics
