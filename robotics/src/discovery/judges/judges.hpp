// Judges: functions from what a search found to an objection against its verdict or its names.
#pragma once

#include <optional>
#include <vector>

#include "discovery/judges/findings.hpp"

namespace llmt::robotics {

/// Objections against single names:
///
/// - undetermined: the fit of everything together puts all values within two standard errors of zero, or holds them;
/// - still_joint: the effect is one of a joint that stands still in the poses searched;
/// - both_signs: compliances of one arm have both signs. A controller may count torques with either, but all with one;
/// - error_of_larger: the effect was found beside larger ones, explains less than SearchOptions::model_error of what
/// they
///   explain, and may be an error of theirs;
/// - part_of_unknown, asked beside something that has no name: all but names that more than four fifths of the
/// explained
///   sum of squares go with alone, less than one fifth with patterns, and that cannot be a part of the unknown.
std::vector<Objection> judge_names(const Findings& found, const DiscoveryOptions& options);

/// Gross errors, asked where nothing was found: the outliers reach their largest share, or the residuals have a heavy
/// tail.
std::optional<Objection> judge_outliers(const Findings& found, const DiscoveryOptions& options);

/// Structure in the residuals, asked where nothing was found, or only names: no instrument scatters like that. An
/// effect of the arm may be the image of an error of the instrument. `stands` says which names stand so far.
std::vector<Objection> judge_residuals(const Findings& found, const std::vector<bool>& stands,
                                       const DiscoveryOptions& options);

/// Every objection that the poses searched give, that of judge_waves() included.
std::vector<Objection> judge(const Findings& found, const DiscoveryOptions& options);

}  // namespace llmt::robotics
