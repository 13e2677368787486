// Constants that a search chose from a grid, fitted.
#pragma once

#include <map>
#include <string>

#include "discovery/investigation.hpp"

namespace llmt::robotics {

/// Fits the presliding of every hysteresis and the order of every transmission error that was looked for in the
/// residuals, together with everything else, and gives their values the errors that belong to such a fit: the share of
/// a wave that is lost where its order is not known is no longer left out. A whole order stays. Effects have new labels
/// then, in `also` too. Returns the standard errors of the constants by the label of their effect.
std::map<std::string, double> refine_constants(Investigation& investigation, const DiscoveryOptions& options,
                                               std::vector<Hypothesis>* also);

}  // namespace llmt::robotics
