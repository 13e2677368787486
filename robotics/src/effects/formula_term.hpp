// A term of a user's own effect, as robot descriptions and catalogues spell it.
#pragma once

#include "llmt/robotics/effect_type.hpp"
#include "yaml/yaml_reader.hpp"

namespace llmt::robotics {

/// A term of a formula: what it acts on, its expression, and what is said of its value.
FormulaTerm read_formula_term(YamlMap& map);

}  // namespace llmt::robotics
