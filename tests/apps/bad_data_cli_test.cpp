// Tables that cannot be learned from: each message has file, line and column, and the exit code is that of data.
#include <fmt/format.h>

#include "apps/programs.hpp"
#include "llmt/random.hpp"

namespace {

using program::Folder;
using program::llmt_program;
using program::Outcome;

// The message that `llmt ARGUMENTS` refuses d.csv with.
std::string refusal_of(const Folder& folder, const std::string& text, const std::string& arguments) {
  folder.write("d.csv", text);
  const Outcome outcome = folder.run(llmt_program + " " + arguments);
  EXPECT_EQ(outcome.exit_code, 1) << arguments << ": " << outcome.err;
  EXPECT_EQ(outcome.out, "") << arguments;
  return outcome.err;
}

// 30 rows of a, b, w, y, of which row 5 (line 6) is another one.
std::string table_with(const std::string& odd_row) {
  std::string text = "a,b,w,y\n";
  for (int i = 1; i <= 30; ++i) text += i == 5 ? odd_row + "\n" : fmt::format("{},{},{},{}\n", i, i % 7, 1, 2 * i);
  return text;
}

TEST(BadData, SeparatorsOfThousandsAreOfferedAndRead) {
  const Folder folder;
  std::string text = "load,y\n";
  for (int i = 0; i < 40; ++i) text += fmt::format("\"{},{:03}\",{}\n", 1 + i / 10, (137 * i) % 1000, i);
  EXPECT_EQ(
      refusal_of(folder, text, "fit d.csv -t y"),
      "llmt: d.csv:2: column \"load\": '1,000' has a comma, which may be a separator of thousands or a decimal comma; "
      "--thousands reads thousands, --decimal-comma reads decimal commas\n");
  EXPECT_EQ(refusal_of(folder, "load,y\n\"1,000.5\",2\n", "fit d.csv -t y --stream"),
            "llmt: d.csv:2: column \"load\": '1,000.5' has separators of thousands; --thousands reads thousands\n");
  folder.write("d.csv", text);
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv -t y --thousands --cv 2 -o m.json").exit_code, 0);
  EXPECT_NE(llmt::read_file(folder.file("m.json")).find("\"low\": 1000.0"), std::string::npos);
  EXPECT_EQ(folder.run(llmt_program + " predict m.json d.csv --thousands").exit_code, 0);
  EXPECT_EQ(folder.run(llmt_program + " explain m.json d.csv --thousands").exit_code, 0);
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv -t y --thousands --stream").exit_code, 0);
}

TEST(BadData, AUnitInEveryCellIsSaid) {
  const Folder folder;
  std::string text = "power,y\n";
  for (int i = 0; i < 40; ++i) text += fmt::format("{}.5 kW,{}\n", i % 9, i);
  folder.write("d.csv", text);
  EXPECT_NE(folder.run(llmt_program + " fit d.csv -t y --cv 2")
                .err.find("column \"power\": every cell is a number and \"kW\", and is taken for categories"),
            std::string::npos);
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv -t y --cv 2 --categorical power").err.find("kW"), std::string::npos);
}

TEST(BadData, ATableWithoutRowsIsNoPrediction) {
  const Folder folder;
  folder.write("d.csv", table_with("5,5,1,10"));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y --cv 0 -o m.json").exit_code, 0);
  EXPECT_EQ(refusal_of(folder, "a,b,w,y\n", "predict m.json d.csv"), "llmt: d.csv: there is a header and no rows\n");
  EXPECT_EQ(refusal_of(folder, "a,b,w,y\r1,2,3,4\r", "predict m.json d.csv").find("llmt: d.csv:1: lines end with CR"),
            0U);
}

TEST(BadData, MagnitudesBeyondTheLargestAreNamed) {
  const Folder folder;
  const std::string fit = "fit d.csv -t y --weight w";
  for (const std::string stream : {"", " --stream"}) {
    const auto refused = [&](const std::string& row, const std::string& message) {
      EXPECT_EQ(refusal_of(folder, table_with(row), fit + stream), "llmt: d.csv:6: column " + message + "\n") << stream;
    };
    refused("1e151,1,1,1", "\"a\": 1e+151 is beyond 1e+150, the largest magnitude to learn from");
    refused("1,-1e308,1,1", "\"b\": -1e+308 is beyond 1e+150, the largest magnitude to learn from");
    refused("1,1,1,-2e200", "\"y\": -2e+200 is beyond 1e+150, the largest magnitude to learn from");
    refused("1,1,1e308,1", "\"w\": 1e+308 is beyond 1e+150, the largest magnitude to learn from");
    refused("1,1,-3,1", "\"w\": a weight must not be negative, it is -3");
  }
  EXPECT_EQ(refusal_of(folder, table_with("1e71,1,1,1"), "fit d.csv -t y --local-models quadratic"),
            "llmt: d.csv:6: column \"a\": 1e+71 is beyond 1e+70, the largest magnitude to learn from\n");
  EXPECT_EQ(refusal_of(folder, table_with("1e151,1,1,1"), "compare d.csv -t y --cv 2"),
            "llmt: d.csv:6: column \"a\": 1e+151 is beyond 1e+150, the largest magnitude to learn from\n");
}

TEST(BadData, LabelsOfCategoriesMayBeAnyNumber) {
  const Folder folder;
  folder.write("d.csv", table_with("1e200,1,1,1"));
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y --categorical a --cv 0");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST(BadData, ColumnsWhoseSquaresVanishAreNamed) {
  const Folder folder;
  std::string text = "x,y\n";
  for (int i = 1; i <= 30; ++i) text += fmt::format("{},{}\n", i * 5e-324, i);
  for (const std::string stream : {"", " --stream"}) {
    EXPECT_EQ(
        refusal_of(folder, text, "fit d.csv -t y" + stream),
        "llmt: d.csv:31: column \"x\": the largest magnitude of the column is 1.5e-322, so that squares vanish: at "
        "least 1e-140 is needed, by another unit\n")
        << stream;
  }
}

TEST(BadData, WeightsThatAreAllZeroAreNamed) {
  const Folder folder;
  std::string text = "x,w,y\n";
  for (int i = 1; i <= 30; ++i) text += fmt::format("{},0,{}\n", i, i);
  EXPECT_EQ(refusal_of(folder, text, "fit d.csv -t y --weight w"), "llmt: d.csv: column \"w\": every weight is 0\n");
}

TEST(BadData, TooManyCategoriesAreNamed) {
  const Folder folder;
  std::string text = "word,x,y\n";
  for (int i = 0; i <= 20001; ++i) text += fmt::format("w{},{},{}\n", i % 10001, i % 5, i % 3);
  EXPECT_EQ(refusal_of(folder, text, "fit d.csv -t y"),
            "llmt: d.csv:10002: column \"word\": more than 10000 categories (--ignore COLUMN leaves a column out)\n");
}

// Words that differ in most rows, and dates of many days, are left out however many they are, unless they were asked
// for.
TEST(BadData, WordsOfEveryRowAreLeftOutHoweverManyTheyAre) {
  const Folder folder;
  std::string text = "word,when,x,y\n";
  std::string plain = "x,y\n";
  for (int i = 0; i < 12000; ++i) {
    const std::string rest = fmt::format("{},{}\n", i % 5, 2 * (i % 5) + i % 3);
    text += fmt::format("w{},{:04}-{:02}-{:02},{}", i, 1990 + i / 336, 1 + i / 28 % 12, 1 + i % 28, rest);
    plain += rest;
  }
  folder.write("d.csv", text);
  folder.write("plain.csv", plain);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --cv 0 -o m.json");
  EXPECT_EQ(fitted.exit_code, 0);
  for (const char* said : {"\"word\" has words, 12000 different ones in 12000 rows, and is left out",
                           "\"when\" has dates, 12000 different ones in 12000 rows, and is left out"}) {
    EXPECT_NE(fitted.err.find(said), std::string::npos) << fitted.err;
  }
  ASSERT_EQ(folder.run(llmt_program + " fit plain.csv -t y --cv 0 -o plain.json").exit_code, 0);
  EXPECT_EQ(llmt::read_file(folder.file("m.json")), llmt::read_file(folder.file("plain.json")));
  EXPECT_EQ(
      refusal_of(folder, text, "fit d.csv -t y --categorical when"),
      "llmt: column \"word\" has words, 12000 different ones in 12000 rows, and is left out; --categorical takes "
      "it for categories\nllmt: d.csv:10002: column \"when\": more than 10000 categories (--ignore COLUMN leaves a "
      "column out)\n");
  EXPECT_EQ(refusal_of(folder, text, "fit d.csv -t y --inputs word,x"),
            "llmt: d.csv:10002: column \"word\": more than 10000 categories\n");
}

// The only input stays, and nobody says that it is left out.
TEST(BadData, ADateThatIsTheOnlyInputStays) {
  const Folder folder;
  std::string text = "when,y\n";
  for (int i = 0; i < 40; ++i) text += fmt::format("2024-{:02}-{:02},{}\n", 1 + i / 28, 1 + i % 28, i % 7);
  folder.write("d.csv", text);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --cv 0");
  EXPECT_EQ(fitted.exit_code, 0);
  EXPECT_EQ(fitted.err.find("left out"), std::string::npos) << fitted.err;
  EXPECT_NE(
      fitted.err.find("has words, 40 different ones in 40 rows, and is taken for categories; it looks like a date"),
      std::string::npos)
      << fitted.err;
}

TEST(BadData, AColumnOfInfinityIsNoColumnOfWords) {
  const Folder folder;
  EXPECT_EQ(refusal_of(folder, "a,x,y\ninf,1,2\n,2,3\n1e400,3,4\n", "fit d.csv -t y"),
            "llmt: d.csv:2: column \"a\": 'inf' is not finite (--ignore COLUMN leaves a column out)\n");
}

TEST(BadData, TextThatIsNotUtf8IsNamedBeforeTheWork) {
  const Folder folder;
  const std::string windows = "; a file of Windows is converted by iconv -f CP1252 -t UTF-8\n";
  EXPECT_EQ(refusal_of(folder, "gr\xF6sse,y\n1,2\n2,3\n", "fit d.csv -t y --json"),
            "llmt: d.csv:1: byte 0xf6 of the name of column 1 of the header is not UTF-8" + windows);
  EXPECT_EQ(refusal_of(folder, "c,y\na,2\n\xF6,3\nb,4\n", "fit d.csv -t y --json"),
            "llmt: d.csv:3: column \"c\": byte 0xf6 of the cell is not UTF-8" + windows);
  EXPECT_EQ(refusal_of(folder, std::string("\xFF\xFE", 2) + std::string("x\0,\0y\0\n\0", 8), "fit d.csv -t y"),
            "llmt: d.csv: this is UTF-16 or no text at all, UTF-8 is needed\n");
  EXPECT_EQ(
      refusal_of(folder, std::string("x,y\n1,2\na\0b,3\n", 14), "fit d.csv -t y"),
      "llmt: d.csv:3: column \"x\": 'a\\0b' is not a number; 1 of 2 cells of the column are numbers: --categorical x "
      "takes all for categories (--ignore COLUMN leaves a column out)\n");
  folder.write("d\xF6.csv", table_with("1,1,1,1"));
  const Outcome named = folder.run(llmt_program + " fit d\xF6.csv -t y --cv 0 --json");
  EXPECT_EQ(named.exit_code, 0) << named.err;
  EXPECT_NE(named.out.find("d\xEF\xBF\xBD.csv"), std::string::npos) << named.out;
}

TEST(BadData, AnOddCellAmongNumbersIsToBeCorrected) {
  const Folder folder;
  const std::string fit = "fit d.csv -t y";
  EXPECT_EQ(
      refusal_of(folder, table_with("27.5 C,1,1,1"), fit),
      "llmt: d.csv:6: column \"a\": '27.5 C' is not a number; all other cells of the column are numbers or empty: "
      "correct this one, or empty it (a missing value)\n");
  EXPECT_EQ(refusal_of(folder,
                       table_with("27.5 \xB0"
                                  "C,1,1,1"),
                       fit)
                .find("llmt: d.csv:6: column \"a\": '27.5 \\xb0C' is not"),
            0U);
  EXPECT_EQ(refusal_of(folder, table_with("x,1,1,1") + "y,1,1,1\n", fit),
            "llmt: d.csv:6: column \"a\": 'x' is not a number; 2 cells of the column are no numbers, 29 are: correct "
            "those, or empty them (missing values)\n");
}

TEST(BadData, NothingToLearnIsSaid) {
  const Folder folder;
  const auto warning = [&](const std::string& text) {
    folder.write("d.csv", text);
    const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y --ignore x");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.err;
  };
  EXPECT_EQ(warning("a,x,y\n3,0,7\n"), "llmt: d.csv has one row: the model is the target of that row everywhere\n");
  EXPECT_EQ(warning("a,x,y\n3,0,7\n5,0,7\n4,1,7\n"),
            "llmt: target \"y\" is 7 in every row: the model is that constant\n");
  EXPECT_EQ(refusal_of(folder, "a,y\n3,7\n", "compare d.csv -t y"),
            "llmt: d.csv has one row: the model is the target of that row everywhere\n"
            "llmt: d.csv: one row leaves none to hold out\n");
}

TEST(BadData, EndlessInputsAreRefused) {
  const Folder folder;
  const auto refused = [&](const std::string& arguments, const std::string& message) {
    const Outcome outcome = folder.run(llmt_program + " " + arguments);
    EXPECT_EQ(outcome.exit_code, 1) << arguments;
    EXPECT_EQ(outcome.err, "llmt: " + message + "\n") << arguments;
  };
  refused("fit /dev/zero -t y", "/dev/zero: cannot be read: no line ends within 16 MiB");
  refused("fit /dev/zero -t y --stream", "/dev/zero:1: no row ends within 16 MiB (is a quote left open?)");
  folder.write("d.csv", table_with("1,1,1,1"));
  refused("discover d.csv d.csv --target y --terms /dev/zero",
          "/dev/zero: cannot be read: it holds more than 16 MiB, the most that is read");
}

TEST(BadData, StreamsSayWhyTheyCannotBeRead) {
  const Folder folder;
  const auto reason = [&](const std::string& path) {
    const Outcome outcome = folder.run(llmt_program + " fit " + path + " -t y --stream");
    EXPECT_EQ(outcome.exit_code, 1);
    return outcome.err;
  };
  EXPECT_EQ(reason("no.csv"), "llmt: no.csv: cannot be read: No such file or directory\n");
  EXPECT_EQ(reason("."), "llmt: .: cannot be read: Is a directory\n");
}

}  // namespace
