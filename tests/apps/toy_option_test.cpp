// The program makes its options from the fields of a fit's options: one that is added is read, ranged and shown.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "oracles/toy_options.hpp"
#include "trees/fit_options.hpp"

namespace llmt::apps {
namespace {

struct Parsed {
  ToyOptions options;
  std::string help;
};

Parsed parse(const std::string& line, bool only_compared = false) {
  Parsed parsed;
  NamedColumns columns;
  CLI::App command{"A command", "toy"};
  command.set_help_all_flag("--help-all", "");
  add_fit_options(command, parsed.options, columns, only_compared);
  parsed.help = command.help("", CLI::AppFormatMode::All);
  command.parse(line);
  return parsed;
}

TEST(ToyOption, IsReadShownAndHasItsRange) {
  const Parsed parsed = parse("--toy 0.5 --folds 3");
  EXPECT_EQ(parsed.options.toy, 0.5);
  EXPECT_EQ(parsed.options.folds, 3);
  EXPECT_NE(parsed.help.find("--toy"), std::string::npos);
  EXPECT_NE(parsed.help.find("A toy"), std::string::npos);
  try {
    parse("--toy 1.5");
    FAIL() << "1.5 is no share";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("--toy is \"1.5\""), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find(any_share.words), std::string::npos) << error.what();
  }
}

TEST(ToyOption, IsNotComparedIfItsEntrySaysSo) {
  EXPECT_EQ(parse("--folds 4", true).options.folds, 4);
  EXPECT_THROW(parse("--toy 0.5", true), CLI::ExtrasError);
}

TEST(SettingNames, AWordOfAMessageIsNoOption) {
  const std::vector<SettingName> names = setting_names();
  EXPECT_EQ(in_words_of_user("llmt::fit: folds.count is 1", names), "--cv is 1");
  EXPECT_EQ(in_words_of_user("llmt::to_json: a model without intervals takes less", names),
            "a model without intervals takes less");
}

}  // namespace
}  // namespace llmt::apps
