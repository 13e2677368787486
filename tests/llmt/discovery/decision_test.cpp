// Which answer follows from which objections: the table of docs/algorithms/rows-in-time.md.
#include "discovery/answer/judges.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace decision_test {
namespace {

using namespace llmt::discovery;

// Cells of the table rows in the section "The answer".
std::vector<std::vector<std::string>> rows_of_the_page() {
  std::ifstream page(std::string(LLMT_DOCS_DIR) + "/algorithms/rows-in-time.md");
  std::vector<std::vector<std::string>> rows;
  bool is_inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) is_inside = line == "## The answer";
    if (!is_inside || !line.starts_with("| ") || line.starts_with("| ---") || line.starts_with("| what")) continue;
    std::vector<std::string> cells;
    std::istringstream rest(line.substr(2));
    for (std::string cell; std::getline(rest, cell, '|');) {
      const std::size_t begin = std::min(cell.find_first_not_of(' '), cell.size());
      cells.push_back(cell.substr(begin, cell.find_last_not_of(' ') + 1 - begin));
    }
    rows.push_back(std::move(cells));
  }
  return rows;
}

FoundTerm term(double value = 1.0) {
  FoundTerm found;
  found.inputs = {"x"};
  found.values = {{"coefficient", "", value, 0.1}};
  return found;
}

void add_terms(const std::string& which, Missing& missing) {
  if (which == "none") return;
  missing.found = {term()};
  if (which == "tentative") object(missing, Reason::no_gain, {0});
  if (which == "with rivals") missing.found[0].rivals = {{"cube x", {"x"}, false}};
}

void add_fact(const std::string& what, Missing& missing) {
  if (what.starts_with("the error on rows set aside")) missing.failing_rows = {1};
  if (what.starts_with("a state")) {
    missing.found.push_back(term());
    missing.found.back().inner_state = "a delay";
  }
  if (what.starts_with("the search found shapes")) missing.verdict.answer = Answer::unknown;
  if (what.starts_with("structure")) missing.structure = {{"", {"x"}, 1e-6, 0.5}};
  if (what.starts_with("more than 5 times")) {
    missing.gaps = {Gap{.output = "", .before = 6.0, .after = 6.0, .noise_floor = 1.0, .nominal = 6.0}};
    missing.gaps[0].known_noise = 1.0;
  }
  if (what.starts_with("parameters")) missing.parameters_explain = true;
  if (what.starts_with("a rival is another")) object(missing, Reason::rival, {0});
}

// Effects in parts approximate any function, as the leaves of a tree do; one of them is a name.
TEST(Decision, SeveralEffectsInPartsMayStandForAnother) {
  Missing missing;
  missing.found = {term(), term()};
  missing.found[0].inputs = {"x", "v"};
  missing.found[1].inputs = {"y", "v"};
  for (FoundTerm& found : missing.found) found.shrinks_gap = true;
  missing.found[0].regime = "v";
  Missing two = missing;
  two.found[1].regime = "v";
  judge_findings(missing, true);
  decide(missing);
  EXPECT_EQ(missing.answer, Answer::named);
  judge_findings(two, true);
  decide(two);
  EXPECT_EQ(two.answer, Answer::unknown);
  EXPECT_FALSE(two.found[0].confirmed || two.found[1].confirmed);
}

TEST(Decision, IsThatOfTheTableInTheDocs) {
  const std::vector<std::vector<std::string>> rows = rows_of_the_page();
  ASSERT_EQ(rows.size(), 12u);
  for (const std::vector<std::string>& cells : rows) {
    ASSERT_EQ(cells.size(), 3u);
    Missing missing;
    missing.verdict.answer = Answer::named;
    add_terms(cells[1], missing);
    add_fact(cells[0], missing);
    judge_findings(missing, true);
    judge_noise(missing);
    if (cells[0].starts_with("a drift")) object(missing, Reason::drift);
    decide(missing);
    EXPECT_EQ(to_string(missing.answer), cells[2]) << cells[0] << ", terms: " << cells[1];
  }
}

// An earlier row goes before a later one.
TEST(Decision, TakesTheFirstRowThatApplies) {
  Missing missing;
  missing.failing_rows = {1};
  missing.structure = {{"", {"x"}, 1e-6, 0.5}};
  missing.found = {term()};
  judge_findings(missing, true);
  decide(missing);
  EXPECT_EQ(missing.answer, Answer::failed_held_out);
  EXPECT_FALSE(missing.found[0].confirmed);
  Missing noisy;
  noisy.gaps = {Gap{.output = "", .before = 6.0, .after = 6.0, .noise_floor = 1.0, .nominal = 6.0}};
  noisy.gaps[0].known_noise = 1.0;
  noisy.parameters_explain = true;
  judge_noise(noisy);
  decide(noisy);
  EXPECT_EQ(noisy.answer, Answer::undecided);
}

// Parameters that were fitted explain nothing if the rows set aside are worse with them.
TEST(Decision, ParametersExplainWhatTheyShrinkOnRowsSetAside) {
  Missing missing;
  missing.parameters_explain = true;
  for (const double fitted : {0.9, 1.1}) {
    missing.gaps = {Gap{.output = "", .before = fitted, .after = fitted, .noise_floor = 1.0, .nominal = 1.0}};
    decide(missing);
    EXPECT_EQ(missing.answer, fitted < 1.0 ? Answer::parameters_only : Answer::nothing_missing);
  }
}

TEST(Decision, ConfirmsTheTermsOfAnOutputTogether) {
  Missing missing;
  missing.verdict.answer = Answer::named;
  missing.found = {term(), term(), term()};
  missing.found[2].output_index = 1;
  object(missing, Reason::no_gain, {1});
  decide(missing);
  EXPECT_FALSE(missing.found[0].confirmed);
  EXPECT_FALSE(missing.found[1].confirmed);
  EXPECT_TRUE(missing.found[2].confirmed);
  EXPECT_EQ(missing.answer, Answer::unknown);
}

// Which of two functions it is, is not known. On rows like these the two are alike, so either may be added.
TEST(Decision, ATermWithARivalThatIsAnotherFunctionIsUndecided) {
  Missing missing;
  missing.verdict.answer = Answer::named;
  missing.found = {term()};
  missing.found[0].rivals = {{"cube x", {"x"}, false}};
  decide(missing);
  EXPECT_EQ(missing.answer, Answer::indistinguishable);
  EXPECT_TRUE(missing.found[0].confirmed);
  object(missing, Reason::rival, {0});
  decide(missing);
  EXPECT_EQ(missing.answer, Answer::undecided);
  EXPECT_FALSE(missing.found[0].confirmed);
  missing.gaps = {Gap{.output = "", .before = 1.0, .after = 0.9, .noise_floor = 0.1, .nominal = 1.0}};
  EXPECT_TRUE(may_be_applied(missing));
  object(missing, Reason::known_noise, {0});
  decide(missing);
  EXPECT_EQ(missing.answer, Answer::unknown);
  EXPECT_FALSE(may_be_applied(missing));
}

// A state is what it is named; whether its size is certain is another question.
TEST(Decision, AStateWithinTwoErrorsIsNone) {
  Missing missing;
  missing.verdict.answer = Answer::named;
  missing.found = {term(0.15)};
  missing.found[0].inner_state = "a delay";
  judge_findings(missing, true);
  decide(missing);
  EXPECT_EQ(missing.answer, Answer::unknown);
  EXPECT_FALSE(missing.found[0].confirmed);
}

}  // namespace
}  // namespace decision_test
