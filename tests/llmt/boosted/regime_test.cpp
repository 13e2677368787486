// What the number of rows decides: one table, for the code and for its readers.
#include "boosted/regime.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "growth/rules/rule.hpp"
#include "llmt/files.hpp"

namespace regime_test {
namespace {

std::string with_spaces(Eigen::Index count) {
  std::string text = fmt::format("{}", count);
  if (text.size() > 4) text.insert(text.size() - 3, " ");
  return text;
}

std::string tree_in_words(const llmt::Regime& regime) {
  if (regime.rules_of_tree.empty()) return "none";
  std::string rules;
  for (const llmt::GrowthRule rule : regime.rules_of_tree) {
    rules += rules.empty() ? "" : " or ";
    for (const char letter : llmt::rule_of(rule).name) rules += static_cast<char>(std::toupper(letter));
  }
  const std::string trees =
      regime.most_rounds_of_tree < llmt::no_limit ? fmt::format(", {} trees", regime.most_rounds_of_tree) : "";
  return fmt::format("{}, to {} inputs{}", rules, regime.most_inputs_of_tree, trees);
}

std::string race_in_words(const llmt::Regime& regime) {
  if (regime.race == llmt::RaceRows::none) return "no";
  return std::string(regime.race == llmt::RaceRows::all_parts ? "all fifths" : "yes") +
         (regime.directions ? ", directions" : "");
}

std::vector<std::string> table() {
  std::vector<std::string> lines = {
      "| rows from | rate | slopes | c | patience | held out | race | one tree | splits from |",
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"};
  for (const llmt::Regime& regime : llmt::regimes) {
    const std::string apart = regime.takes_turns      ? "each fifth in turn"
                              : regime.uses_all_parts ? "a fifth, then all"
                              : regime.held_out > 0   ? "about " + with_spaces(regime.held_out)
                                                      : "a fifth";
    const std::string searched = regime.searched < llmt::no_limit ? with_spaces(regime.searched) + " rows" : "all rows";
    lines.push_back(fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} |", with_spaces(regime.rows), regime.rate,
                                regime.slopes, regime.ridge, regime.patience, apart, race_in_words(regime),
                                tree_in_words(regime), searched));
  }
  return lines;
}

void expect_table(const std::string& file, const std::string& before_line) {
  std::string expected;
  for (const std::string& line : table()) expected += before_line + line + "\n";
  const std::string text = llmt::read_file(std::string(LLMT_ROOT) + "/" + file);
  EXPECT_NE(text.find(expected), std::string::npos) << file << " lacks the table\n" << expected;
}

TEST(Regimes, AreThoseOfTheDocumentation) {
  expect_table("docs/algorithms/boosting.md", "");
  expect_table("llmt/include/llmt/boosted.hpp", "/// ");
}

TEST(Regimes, BeginAtTheirRows) {
  EXPECT_TRUE(std::ranges::is_sorted(llmt::regimes, {}, &llmt::Regime::rows));
  EXPECT_EQ(llmt::regime_of(1, 1).rows, llmt::regimes.front().rows);
  for (std::size_t k = 0; k < llmt::regimes.size(); ++k) {
    EXPECT_EQ(llmt::regime_of(llmt::regimes[k].rows, 1).rows, llmt::regimes[k].rows);
    if (k > 0) {
      EXPECT_EQ(llmt::regime_of(llmt::regimes[k].rows - 1, 1).rows, llmt::regimes[k - 1].rows);
    }
    const Eigen::Index most = llmt::regimes[k].most_inputs_of_tree;
    EXPECT_EQ(llmt::regime_of(llmt::regimes[k].rows, most).rules_of_tree.size(), llmt::regimes[k].rules_of_tree.size());
    EXPECT_TRUE(llmt::regime_of(llmt::regimes[k].rows, most + 1).rules_of_tree.empty());
  }
}

}  // namespace
}  // namespace regime_test
