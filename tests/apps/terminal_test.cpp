// What people read on a terminal: help, names that were misspelt, lines that fit, progress.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "apps/programs.hpp"
#include "report/text/text.hpp"
#include "shared/cli.hpp"

namespace {

using llmt::apps::in_words_of_user;
using llmt::apps::progress_line;
using llmt::report::no_width_limit;
using llmt::report::Table;
using llmt::report::wrapped;
using program::Folder;
using program::llmt_program;
using program::Outcome;

std::string small_table() {
  std::string text = "x,y\n";
  for (int i = 0; i < 30; ++i) text += fmt::format("{},{}\n", (7 * i) % 31, 2 * i);
  return text;
}

std::string refusal(const Folder& folder, const std::string& arguments, int exit_code = 2) {
  const Outcome outcome = folder.run(llmt_program + " " + arguments);
  EXPECT_EQ(outcome.exit_code, exit_code) << arguments;
  EXPECT_EQ(outcome.out, "") << arguments;
  return outcome.err;
}

std::size_t longest_line(const std::string& text) {
  std::istringstream lines(text);
  std::size_t longest = 0;
  for (std::string line; std::getline(lines, line);) longest = std::max(longest, line.size());
  return longest;
}

TEST(Names, ThatAreMisspeltAreGuessed) {
  const Folder folder;
  folder.write("d.csv", small_table());
  EXPECT_EQ(
      refusal(folder, "fti d.csv"),
      "llmt: there is no command \"fti\" (did you mean \"fit\"?); the commands are fit, predict, simulate, inspect, "
      "explain, check, compare, signals, table, discover, export\n");
  EXPECT_EQ(
      refusal(folder, ""),
      "llmt: a command is needed: fit, predict, simulate, inspect, explain, check, compare, signals, table, discover, "
      "export; llmt --help says what they do\n");
  EXPECT_EQ(refusal(folder, "fit d.csv --traget y"),
            "llmt: there is no option --traget (did you mean \"--target\"?); llmt fit --help lists them\n");
  EXPECT_EQ(refusal(folder, "fit d.csv -t y --sooner"),
            "llmt: there is no option --sooner; llmt fit --help lists them\n");
  EXPECT_EQ(
      refusal(folder, "fit d.csv -t y --validity crips"),
      "llmt: --validity is \"crips\" (did you mean \"crisp\"?), it must be one of auto, crisp, blend, gaussian\n");
  EXPECT_EQ(refusal(folder, "fit d.csv -t yy", 1),
            "llmt: d.csv: there is no column \"yy\" (did you mean \"y\"?); the columns are x, y\n");
  folder.write("s.csv", "cement,strength\n1,2\n");
  EXPECT_EQ(refusal(folder, "fit s.csv -t stregnth", 1),
            "llmt: s.csv: there is no column \"stregnth\" (did you mean \"strength\"?); the columns are cement, "
            "strength\n");
}

TEST(Names, OfTheLibraryBecomeThoseOfTheCommandLine) {
  const llmt::apps::SettingName names[] = {{"folds.count", "--cv"}, {"rule", "--rule"}};
  EXPECT_EQ(in_words_of_user("llmt::fit: folds.count is 1", names), "--cv is 1");
  EXPECT_EQ(in_words_of_user("m.json: llmt::Intervals: level 2", {}), "m.json: level 2");
  EXPECT_EQ(in_words_of_user("llmt::fit: rules and rule", names), "rules and --rule");
  EXPECT_EQ(in_words_of_user("d.csv: rule", names), "d.csv: rule");
  const Folder folder;
  folder.write("d.csv", small_table());
  EXPECT_EQ(refusal(folder, "fit d.csv -t y --cv 1"), "llmt: --cv is 1, it must be 0 or at least 2\n");
}

TEST(Arguments, OptionsMayStandBeforeTheFile) {
  const Folder folder;
  folder.write("d.csv", small_table());
  EXPECT_EQ(folder.run(llmt_program + " fit --target y --ignore x,x d.csv").exit_code, 2);  // x twice
  EXPECT_EQ(folder.run(llmt_program + " fit --inputs x --target y d.csv").exit_code, 0);
  EXPECT_NE(folder.run(llmt_program + " fit -t y --inputs x none.csv").err.find("none.csv: "), std::string::npos);
  EXPECT_EQ(refusal(folder, "fit -t y --inputs x z d.csv"),
            "llmt: The following argument was not expected: z; several names are separated by commas: --inputs "
            "x,z\n");
}

TEST(Arguments, ADashIsStandardInput) {
  const Folder folder;
  folder.write("d.csv", small_table());
  const Outcome piped = folder.run(llmt_program + " fit - -t y -o m.json <d.csv");
  EXPECT_EQ(piped.exit_code, 0) << piped.err;
  EXPECT_EQ(piped.out.substr(0, 15), "standard input:");
  const Outcome direct = folder.run(llmt_program + " fit d.csv -t y -o n.json");
  EXPECT_EQ(llmt::read_file(folder.file("m.json")), llmt::read_file(folder.file("n.json")));
  EXPECT_EQ(folder.run(llmt_program + " predict m.json - <d.csv").out,
            folder.run(llmt_program + " predict m.json d.csv").out);
}

TEST(Arguments, DecimalCommasAreRefusedWithTheOptionThatReadsThem) {
  const Folder folder;
  std::string commas = "x;y\n";
  std::string points = "x;y\n";
  for (int i = 0; i < 30; ++i) {
    commas += fmt::format("{},5;{},25\n", (7 * i) % 31, 2 * i);
    points += fmt::format("{}.5;{}.25\n", (7 * i) % 31, 2 * i);
  }
  folder.write("c.csv", commas);
  folder.write("p.csv", points);
  const std::string refused =
      "'0,25' has a decimal comma, and a decimal point is expected; --decimal-comma reads such files\n";
  EXPECT_EQ(refusal(folder, "fit c.csv -t y", 1), "llmt: c.csv:2: column \"y\": " + refused);
  // An input of nothing but decimal commas is no category.
  folder.write("x.csv", "x;y\n1,5;1\n2,5;2\n3,5;3\n");
  EXPECT_EQ(refusal(folder, "fit x.csv -t y", 1),
            "llmt: x.csv:2: column \"x\": '1,5' has a decimal comma, and a decimal point is expected; --decimal-comma "
            "reads such files\n");
  EXPECT_EQ(refusal(folder, "fit p.csv -t y --decimal-comma", 1),
            "llmt: p.csv:2: column \"y\": '0.25' has a decimal point, and a decimal comma is expected; leave "
            "--decimal-comma out\n");
  ASSERT_EQ(folder.run(llmt_program + " fit c.csv -t y --decimal-comma -o c.json").exit_code, 0);
  ASSERT_EQ(folder.run(llmt_program + " fit p.csv -t y -o p.json").exit_code, 0);
  EXPECT_EQ(llmt::read_file(folder.file("c.json")), llmt::read_file(folder.file("p.json")));
  std::string expected = folder.run(llmt_program + " predict p.json p.csv").out;
  std::ranges::replace(expected, '.', ',');
  EXPECT_EQ(folder.run(llmt_program + " predict c.json c.csv --decimal-comma").out, expected);
}

TEST(Arguments, InputsByAccidentAreNamed) {
  const Folder folder;
  std::string text = "id,name,x,y\n";
  for (int i = 0; i < 60; ++i) text += fmt::format("{},part{},{},{}\n", i + 1, i, (7 * i) % 61, 2 * i);
  folder.write("d.csv", text);
  EXPECT_EQ(
      folder.run(llmt_program + " fit d.csv -t y").err,
      "llmt: column \"name\" has words, 60 different ones in 60 rows, and is left out; --categorical takes it for "
      "categories\n"
      "llmt: column \"id\" numbers the rows and is an input; --ignore leaves it out\n");
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv -t y --inputs id,x").err, "");
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv -t y --ignore id --categorical name").err, "");
}

TEST(Help, FitsTheTerminalAndHidesOptionsForExperts) {
  const Folder folder;
  for (const char* program : {LLMT_PROGRAM}) {
    const std::string all = folder.run(std::string(program) + " --help-all").out;
    EXPECT_LE(longest_line(all), 104U);  // commands are indented
  }
  const std::string usual = folder.run(llmt_program + " fit --help").out;
  const std::string all = folder.run(llmt_program + " fit --help-all").out;
  EXPECT_LE(longest_line(usual), 100U);
  EXPECT_EQ(usual.find("--ridge"), std::string::npos);
  EXPECT_NE(usual.find("more options for experts: --help-all"), std::string::npos);
  EXPECT_NE(all.find("--ridge NUMBER,..."), std::string::npos);
  EXPECT_EQ(all.find("docs/"), std::string::npos);
}

// The names of the options that --help-all of a command lists.
std::set<std::string> options_in_help(const std::string& help) {
  std::set<std::string> names;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find("--");
    if (!line.starts_with("  -") || begin == std::string::npos) continue;
    names.insert(line.substr(begin, line.find_first_of(" [,", begin) - begin));
  }
  return names;
}

TEST(Manual, HasEveryOptionOfTheHelp) {
  const Folder folder;
  std::string page = folder.run(llmt_program + " --man").out;
  ASSERT_TRUE(page.starts_with(".TH LLMT 1"));
  for (std::size_t at = page.find("\\-"); at != std::string::npos; at = page.find("\\-")) page.erase(at, 1);
  for (const std::string command : {"fit", "predict", "inspect", "explain", "compare", "discover"}) {
    const std::size_t begin = page.find(".SS llmt " + command);
    ASSERT_NE(begin, std::string::npos) << command;
    const std::string section = page.substr(begin, page.find("\n.S", begin + 1) - begin);
    const std::set<std::string> names = options_in_help(folder.run(llmt_program + " " + command + " --help-all").out);
    EXPECT_GT(names.size(), 3U);
    for (const std::string& name : names) EXPECT_NE(section.find(name), std::string::npos) << command << " " << name;
  }
}

TEST(Manual, TheShellCompletesCommandsAndOptions) {
  const Folder folder;
  if (folder.run("bash --version").exit_code != 0) GTEST_SKIP() << "there is no bash";
  folder.write("llmt.bash", folder.run(llmt_program + " --bash-completion").out);
  const auto completed = [&](const std::string& words, int position) {
    folder.write("ask.bash", fmt::format("source llmt.bash\nCOMP_WORDS=({}) COMP_CWORD={}\n_llmt\n"
                                         "echo \"${{COMPREPLY[*]}}\"\n",
                                         words, position));
    const Outcome outcome = folder.run("bash ask.bash");
    EXPECT_EQ(outcome.err, "");
    return outcome.out;
  };
  EXPECT_EQ(completed("llmt pre", 1), "predict\n");
  EXPECT_EQ(completed("llmt fit --tar", 2), "--target\n");
  EXPECT_EQ(completed("llmt predict --int", 2), "--interval\n");
  EXPECT_EQ(completed("llmt fit d", 2), "\n");  // a file, which bash itself completes
}

TEST(Text, IsBrokenAtBlanks) {
  EXPECT_EQ(wrapped("one two three", no_width_limit), "one two three");
  EXPECT_EQ(wrapped("one two three", 7), "one two\nthree");
  EXPECT_EQ(wrapped("  one two three", 9, 2), "  one two\n    three");
  EXPECT_EQ(wrapped("incomprehensible text\n\nend\n", 6), "incomprehensible\ntext\n\nend\n");
  EXPECT_EQ(wrapped("µµµ µµµ", 7), "µµµ µµµ");
}

TEST(Text, ATableBreaksItsWidestWords) {
  Table table({"name", "value"});
  table.add({"a short one", "1.5"});
  table.add({"one that is longer than all the others", "20"});
  EXPECT_EQ(table.text(no_width_limit),
            "name                                    value\n"
            "a short one                               1.5\n"
            "one that is longer than all the others     20\n");
  EXPECT_EQ(table.text(30),
            "name                     value\n"
            "a short one                1.5\n"
            "one that is longer than     20\n"
            "all the others\n");
}

TEST(Text, ATableOfNumbersBreaksItsHeadersThenItself) {
  Table table({"method", "RMSE held-out", "largest jump", "fit, s"});
  table.add({"least squares", "0.2652", "0", "0.01"});
  table.add({"tree", "0.09", "1.25", "12.5"});
  EXPECT_EQ(table.text(40),
            "method             RMSE  largest  fit,\n"
            "               held-out     jump     s\n"
            "least squares    0.2652        0  0.01\n"
            "tree               0.09     1.25  12.5\n");
  EXPECT_EQ(table.text(30),
            "method             RMSE\n"
            "               held-out\n"
            "least squares    0.2652\n"
            "tree               0.09\n"
            "\n"
            "method         largest  fit,\n"
            "                  jump     s\n"
            "least squares        0  0.01\n"
            "tree              1.25  12.5\n");
  EXPECT_LE(longest_line(table.text(40)), 40U);
}

TEST(ProgressLine, NamesTheTimeThatIsLeft) {
  EXPECT_EQ(progress_line("fitting", 0, 10, 3.0), "fitting, 3 s");
  EXPECT_EQ(progress_line("fitting", 5, 10, 30.0), "fitting [###############...............] 50 %, about 30 s left");
  EXPECT_EQ(progress_line("fitting", 1, 10, 60.0), "fitting [###...........................] 10 %, about 9 min left");
  EXPECT_EQ(progress_line("fitting", 12, 10, 60.0), "fitting [#############################.] 99 %, about 1 s left");
}

}  // namespace
