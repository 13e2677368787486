/// \file
/// Plausible sizes of physical effects, and the user's own effects, read from YAML.
///
///     DiscoveryOptions options;
///     options.catalogue = read_catalogue("effects.yaml");
#pragma once

#include <string>
#include <vector>

#include "llmt/robotics/effects.hpp"

namespace llmt::robotics {

/// Reads a catalogue: effect_types() with what the file changes, then the file's own effects.
///
///     effects:
///       - type: joint_compliance              # of effect_types(); any of the following may be absent and then stays
///         title: joint compliance             # as an engineer says it
///         search: false                       # whether discovery looks for it
///         note: stiff arm                     # where the range is from
///         parameters:
///           compliance: {scale: 1e-7, lower: 0, upper: 1e-6}   # in the parameter's unit
///       - formula: belt_pitch                 # a new effect and family, sum of values times terms
///         title: pitch error of the belt
///         place: joint                        # joint or robot
///         terms:                              # joint, x, y or z: what the term acts on, see FormulaTerm
///           - {name: cosine, joint: "cos(37 * q{})", unit: rad, scale: 1e-4, lower: -1e-3, upper: 1e-3}
///           - {name: sine, joint: "sin(37 * q{})", unit: rad, scale: 1e-4, lower: -1e-3, upper: 1e-3}
///
/// Throws std::runtime_error `path:line: where: what` for a file that cannot be read or is no YAML, for unknown,
/// repeated or missing keys, effects or parameters that do not exist, and ranges that are out of order.
std::vector<EffectType> read_catalogue(const std::string& path);

/// As read_catalogue(), from memory; `name` stands for the path in messages.
std::vector<EffectType> parse_catalogue(const std::string& text, const std::string& name);

}  // namespace llmt::robotics
