#include "discovery/judges/decision.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>

namespace llmt::robotics {
namespace {

using discovery::Answer;

const std::map<std::string, Reason> against_verdict = {{"gross errors", Reason::gross_errors},
                                                       {"structured residuals", Reason::structured_residuals},
                                                       {"harmonics", Reason::harmonics},
                                                       {"worse fit", Reason::worse_fit},
                                                       {"held-out loss", Reason::held_out_loss}};
const std::map<std::string, Reason> against_names = {{"undetermined", Reason::undetermined},
                                                     {"still joint", Reason::still_joint},
                                                     {"both signs", Reason::both_signs},
                                                     {"refits", Reason::refits},
                                                     {"arm instead", Reason::arm_instead},
                                                     {"part of the unknown", Reason::part_of_unknown},
                                                     {"error of a larger effect", Reason::error_of_larger},
                                                     {"instrument residuals", Reason::instrument_residuals}};
const std::map<std::string, Headline> headlines = {
    {"TOO MANY OUTLIERS.", Headline::gross_errors},
    {"UNKNOWN EFFECT. No candidate explains what is left", Headline::structured_residuals},
    {"NOTHING MISSING.", Headline::nothing_missing},
    {"NAMED.", Headline::named},
    {"NAMED, BUT NOT ALONE.", Headline::named_with_rivals},
    {"LIKELY CAUSES, NONE CERTAIN. Together", Headline::likely_causes},
    {"LIKELY CAUSES, NONE WRITTEN.", Headline::likely_causes_unwritten},
    {"UNKNOWN EFFECT, NAMED IN PART.", Headline::named_in_part},
    {"LIKELY CAUSES, NONE CERTAIN. Beside them", Headline::likely_causes_in_part},
    {"UNKNOWN EFFECT. Something real is missing", Headline::unknown}};

// Cells of the table rows in the section "The answer".
std::vector<std::vector<std::string>> rows_of_the_page() {
  std::ifstream page(std::string(LLMT_ROBOTS_DIR) + "/../../docs/discovery.md");
  std::vector<std::vector<std::string>> rows;
  bool is_inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) is_inside = line == "## The answer";
    if (!is_inside || !line.starts_with("| ") || line.starts_with("| ---")) continue;
    std::vector<std::string> cells;
    std::istringstream rest(line.substr(2));
    for (std::string cell; std::getline(rest, cell, '|');) {
      if (rest.peek() == ' ') rest.get();
      cells.push_back(cell.substr(0, cell.find_last_not_of(' ') + 1));
    }
    rows.push_back(std::move(cells));
  }
  return rows;
}

// The parts of a cell in `backticks`.
std::set<std::string> keys_of(const std::string& cell) {
  std::set<std::string> keys;
  for (std::size_t begin = cell.find('`'); begin != std::string::npos;) {
    const std::size_t end = cell.find('`', begin + 1);
    keys.insert(cell.substr(begin + 1, end - begin - 1));
    begin = cell.find('`', end + 1);
  }
  return keys;
}

struct Case {
  Answer verdict;
  std::vector<Objection> objections;
  std::vector<Name> names;
  std::string confirmed;  // in the words of the page
};

// A larger and a smaller name, either of them absent, opposed or confirmed.
std::vector<Case> cases_of(Answer verdict, const std::vector<Objection>& objections) {
  std::vector<Case> cases;
  for (const char* larger : {"absent", "opposed", "confirmed"}) {
    for (const char* smaller : {"absent", "opposed", "confirmed", "rivalled"}) {
      Case one{verdict, objections, {}, ""};
      const auto add = [&](const std::string& state, bool is_smaller) {
        if (state == "absent") return;
        FoundEffect effect;
        effect.smaller = is_smaller;
        if (state != "confirmed") effect.rivals = {"link_bending@joint2"};
        if (state == "opposed") one.objections.push_back({Reason::undetermined, {one.names.size()}});
        one.names.push_back({effect, 1.0});
      };
      add(larger, false);
      add(smaller, true);
      const bool has_larger = std::string(larger) == "confirmed";
      const bool has_rivals = std::string(smaller) == "rivalled";
      const bool has_smaller = has_rivals || std::string(smaller) == "confirmed";
      one.confirmed = has_larger && has_rivals ? "larger, and smaller with rivals"
                      : has_larger             ? "larger"
                      : has_smaller            ? "only smaller"
                      : one.names.empty()      ? ""
                                               : "none of the names";
      cases.push_back(std::move(one));
    }
  }
  return cases;
}

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const Answer verdict : {Answer::nothing_missing, Answer::named, Answer::indistinguishable, Answer::unknown}) {
    for (unsigned subset = 0; subset < 32; ++subset) {
      std::vector<Objection> objections;
      unsigned bit = 1;
      for (const auto& [key, reason] : against_verdict) {
        if (subset & bit) objections.push_back({reason});
        bit *= 2;
      }
      for (Case& one : cases_of(verdict, objections)) cases.push_back(std::move(one));
    }
  }
  return cases;
}

bool applies(const std::vector<std::string>& row, const Case& one) {
  std::set<std::string> raised;
  for (const Objection& objection : one.objections) {
    for (const auto& [key, reason] : against_verdict) {
      if (reason == objection.reason) raised.insert(key);
    }
  }
  const std::string verdict = to_string(one.verdict);
  const bool is_verdict = row[0] == "any" || keys_of(row[0]).contains(verdict);
  const bool is_objection =
      row[1] == "any" || (row[1] == "none" ? raised.empty() : raised.contains(*keys_of(row[1]).begin()));
  const bool is_certainty = row[2] == "any" || keys_of(row[2]).contains(one.confirmed);
  return is_verdict && is_objection && is_certainty;
}

TEST(Decision, IsTheTableOfThePageForEveryCombination) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& row : rows_of_the_page()) {
    if (row.size() == 5 && row[0] != "verdict of the search") rows.push_back(row);
  }
  ASSERT_EQ(rows.size(), headlines.size());
  for (const Case& one : all_cases()) {
    const auto row = std::ranges::find_if(rows, [&](const auto& each) { return applies(each, one); });
    ASSERT_NE(row, rows.end());
    const Decision decision = decide(one.verdict, one.objections, one.names);
    const std::string what = to_string(one.verdict) + ", " + (*row)[1] + ", " + one.confirmed;
    EXPECT_EQ(to_string(decision.answer), *keys_of((*row)[3]).begin()) << what;
    EXPECT_EQ(decision.headline, headlines.at(*keys_of((*row)[4]).begin())) << what;
  }
}

TEST(Decision, ObjectionsSpeakAgainstWhatThePageSays) {
  std::set<std::string> listed;
  for (const auto& row : rows_of_the_page()) {
    if (row.size() != 3 || row[0] == "objection") continue;
    const std::string key = *keys_of(row[0]).begin();
    listed.insert(key);
    const bool is_of_verdict = row[2].starts_with("the verdict");
    EXPECT_EQ(against_verdict.contains(key), is_of_verdict) << key;
    EXPECT_EQ(against_names.contains(key), !is_of_verdict) << key;
    if (!against_verdict.contains(key) && !against_names.contains(key)) continue;
    const Reason reason = is_of_verdict ? against_verdict.at(key) : against_names.at(key);
    const std::vector<Name> names(2);
    const Decision opposed = decide(Answer::named, {{reason, {1}}}, names);
    EXPECT_EQ(opposed.confirmed, (std::vector<bool>{true, false})) << key;
    EXPECT_EQ(opposed.answer == Answer::named, !is_of_verdict) << key;
  }
  EXPECT_EQ(listed.size(), against_verdict.size() + against_names.size());
}

}  // namespace
}  // namespace llmt::robotics
