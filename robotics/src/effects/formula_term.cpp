#include "effects/formula_term.hpp"

#include <fmt/format.h>

namespace llmt::robotics {

FormulaTerm read_formula_term(YamlMap& map) {
  FormulaTerm term{.acts_on = {}, .text = {}};
  for (const char* target : {"joint", "x", "y", "z"}) {
    if (!map.has(target)) continue;
    if (!term.acts_on.empty()) map.refuse("a term acts on one of joint, x, y, z, not on two");
    term.acts_on = target;
    term.text = map.text(target);
  }
  if (term.acts_on.empty()) map.refuse("a term needs one of the keys joint, x, y, z with an expression");
  term.name = map.text_or("name", "");
  term.unit = map.text_or("unit", "");
  term.scale = map.number_or("scale", term.scale);
  if (map.has("scale") && !(term.scale > 0.0))
    map.refuse("scale", fmt::format("\"scale\" is {}, must be > 0", term.scale));
  return term;
}

}  // namespace llmt::robotics
