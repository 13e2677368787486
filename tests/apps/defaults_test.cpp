// The defaults of the library are those of the help text, from which docs/options.md is made.
#include <fmt/format.h>

#include <sstream>

#include "apps/program.hpp"
#include "llmt/options.hpp"

namespace {

// Every blank and line break becomes one blank.
std::string on_one_line(const std::string& text) {
  std::string line;
  std::istringstream words(text);
  for (std::string word; words >> word;) line += (line.empty() ? "" : " ") + word;
  return line;
}

TEST(Defaults, HelpStatesThoseOfTheLibrary) {
  const program::Folder folder;
  const std::string help = on_one_line(folder.run(LLMT_PROGRAM " fit --help-all").out);
  for (const char* option :
       {"max_leaves", "min_leaf_samples", "significance", "widths", "jumps", "ridges", "shrinkages"}) {
    const std::string text = llmt::default_text(option);
    EXPECT_NE(help.find("[" + text + "]"), std::string::npos) << option << ": " << text << "\n" << help;
  }
  for (const llmt::Choice<llmt::GrowthRule>& rule : llmt::choices<llmt::GrowthRule>()) {
    if (rule.name == "toy") continue;  // a rule of these tests, which the program does not have
    EXPECT_NE(help.find(fmt::format("{} ({})", rule.name, llmt::summary_of(rule.value))), std::string::npos);
  }
}

}  // namespace
