#include "growth/rules/rule.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace llmt {

const Rule& rule_of(GrowthRule rule) {
  const std::vector<Rule>& table = rule_table();
  const int row = static_cast<int>(rule);
  if (row < 0 || row >= std::ssize(table)) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: rule is number {}, it must be one of {}", row, list_names<GrowthRule>()));
  }
  return table[row];
}

template <>
std::span<const Choice<GrowthRule>> choices() {
  static const std::vector<Choice<GrowthRule>> all = [] {
    std::vector<Choice<GrowthRule>> rows;
    for (const Rule& rule : rule_table()) {
      rows.push_back({static_cast<GrowthRule>(rows.size()), rule.name});
    }
    return rows;
  }();
  return all;
}

std::string_view title_of(GrowthRule rule) { return rule_of(rule).title; }

std::string_view summary_of(GrowthRule rule) { return rule_of(rule).summary; }

bool has_own_models(GrowthRule rule) { return rule_of(rule).has_own_models; }

}  // namespace llmt
