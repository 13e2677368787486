#include "growth/rules/rows.hpp"

namespace llmt {

// Alone in this source, so that the test of the table can link one with a further rule in its place.
const std::vector<Rule>& rule_table() {
  static const std::vector<Rule> rules = library_rules();
  return rules;
}

}  // namespace llmt
