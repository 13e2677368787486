#include "effects/effect_entries.hpp"

namespace llmt::robotics {

// Alone in this source, so that the test of a type that is added can link another table in its place.
std::vector<EffectType> effect_table() { return library_effects(); }

std::string size_table() { return default_catalogue_yaml; }

}  // namespace llmt::robotics
