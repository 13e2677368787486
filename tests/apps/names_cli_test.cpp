// Names of columns that hold what separates, quotes or gives orders.
#include <fmt/format.h>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace {

using program::Folder;
using program::llmt_program;
using program::Outcome;

std::string table(const std::string& input, const std::string& target) {
  std::string text = llmt::csv_field(input) + ",b," + llmt::csv_field(target) + "\n";
  for (int i = 0; i < 30; ++i) text += fmt::format("{},{},{}\n", i, (7 * i) % 11, 2 * i);
  return text;
}

// As a word of the shell.
std::string word(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? "'\\''" : std::string(1, c);
  return result + "'";
}

TEST(Names, WithACommaAreGivenInQuotes) {
  const Folder folder;
  folder.write("d.csv", table("load, kg", "consumption, kWh/h"));
  const std::string target = word("\"consumption, kWh/h\"");
  EXPECT_EQ(
      folder.run(llmt_program + " fit d.csv --cv 2 -t " + target + " --inputs " + word("\"load, kg\",b")).exit_code, 0);
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv --cv 2 -t " + target + " --ignore " + word("\"load, kg\"")).exit_code,
            0);
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv --cv 2 -t b --weight " + word("load, kg")).exit_code, 0);
  const Outcome split = folder.run(llmt_program + " fit d.csv -t " + word("consumption, kWh/h"));
  EXPECT_EQ(split.exit_code, 1);
  EXPECT_NE(
      split.err.find("there is no column \"consumption\" (a name with a comma is given in its quotes: '\"consumption, "
                     "kWh/h\"')"),
      std::string::npos)
      << split.err;
  EXPECT_NE(split.err.find("the columns are \"load, kg\", b, \"consumption, kWh/h\""), std::string::npos) << split.err;
  EXPECT_EQ(llmt::apps::names_in("\"a, \"\"b\"\"\",c,\"d\"x,e\"f,\"g"),
            (std::vector<std::string>{"a, \"b\"", "c", "dx", "e\"f", "\"g"}));
}

TEST(Names, WithQuotesAndEndsOfCdataArePlotted) {
  if (std::system("command -v gnuplot >/dev/null") != 0) GTEST_SKIP() << "there is no gnuplot";
  const Folder folder;
  for (const std::string name :
       {"'a", "a''b", "'; system(\"touch PWNED\") #", "`touch PWNED`", "]]>", "a\\", "@x $(touch PWNED)"}) {
    folder.write("d.csv", table("a", name));
    const Outcome outcome =
        folder.run(llmt_program + " fit d.csv --cv 2 --plot p.svg -t " + word(llmt::csv_field(name)));
    EXPECT_EQ(outcome.exit_code, 0) << name << outcome.err;
    EXPECT_EQ(llmt::read_file(folder.file("p.svg")).find("]]>"), std::string::npos) << name;
  }
  EXPECT_FALSE(std::filesystem::exists(folder.file("PWNED")));
}

TEST(Names, MarksOfDirectionAndLineBreaksAreShownAsBytes) {
  using llmt::apps::without_controls;
  EXPECT_EQ(without_controls("a\xE2\x80\xAE"
                             "b\xE2\x81\xA6\xD8\x9C\xE2\x80\xA8\xFE\x1B"),
            "a\\xe2\\x80\\xae"
            "b\\xe2\\x81\\xa6\\xd8\\x9c\\xe2\\x80\\xa8\\xfe\\x1b");
  EXPECT_EQ(without_controls("gr\xC3\xB6\xC3\x9F"
                             "e \xE2\x82\xAC \xF0\x9F\x98\x80\n\t"),
            "gr\xC3\xB6\xC3\x9F"
            "e \xE2\x82\xAC \xF0\x9F\x98\x80\n\t");
  const Folder folder;
  folder.write("d.csv", table("a\nllmt: all is well", "y"));
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t z");
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

TEST(Names, OfTermsInUtf16AreRefusedAsThat) {
  const Folder folder;
  folder.write("d.csv", table("a", "y"));
  for (const std::string mark : {"\xFF\xFE", "\xFE\xFF"}) {
    folder.write("t.txt", mark + std::string("u\0=\0a\0", 6));
    EXPECT_EQ(folder.run(llmt_program + " discover d.csv d.csv -t y --terms t.txt").err,
              "llmt: t.txt: this is UTF-16, UTF-8 is needed\n");
  }
}

}  // namespace
