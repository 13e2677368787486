// Harmonics of an angle error that was named as a wave of a gear.
#pragma once

#include <optional>
#include <vector>

#include "discovery/judges/findings.hpp"

namespace llmt::robotics {

/// A gear's wave is a sine with at most one harmonic of twice its order. A saw tooth, a step in every turn of a shaft
/// and the like have harmonics of 3, 4 and 5 times the order as well. The judge fits those to the residuals. If they
/// are beyond chance and hold a material share of the wave's own energy, the wave is a part of an unknown effect: the
/// objection speaks against all waves of that joint. `stands` says which names stand so far; only their waves are
/// judged.
std::optional<Objection> judge_waves(const Findings& found, const std::vector<bool>& stands);

/// Numbers of the waves on whose joints one of the patterns acts.
std::vector<std::size_t> waves_at(const std::vector<FoundPattern>& patterns, const std::vector<Name>& names);

}  // namespace llmt::robotics
