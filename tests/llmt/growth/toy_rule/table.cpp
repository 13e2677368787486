// The table of growth rules with a row more, linked instead of the library's.
#include "growth/rules/rows.hpp"
#include "llmt/growth/toy_rule/halving.hpp"

namespace llmt {

const std::vector<Rule>& rule_table() {
  static const std::vector<Rule> rules = [] {
    std::vector<Rule> rows = library_rules();
    rows.push_back({.name = "toy",
                    .title = "Toy halves",
                    .summary = "halves the rows",
                    .grow = toy_rule::grow_halves,
                    .usual_method = "toy"});
    return rows;
  }();
  return rules;
}

}  // namespace llmt
