// What the program llmt says of tables and arguments that are not as they should be.
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"
#include "llmt/names.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::llmt_program;
using program::Outcome;

std::string refused_text(const Folder& folder, const std::string& arguments, int exit_code) {
  const Outcome outcome = folder.run(llmt_program + " " + arguments);
  EXPECT_EQ(outcome.exit_code, exit_code) << arguments;
  EXPECT_EQ(outcome.out, "") << arguments;
  return outcome.err;
}

// y = 2 a, exactly; b is noise.
std::string line_and_noise(int rows) {
  llmt::Random random(7);
  std::string text = "a,b,y\n";
  for (int i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", a, random.normal(), 2.0 * a);
  }
  return text;
}

TEST(Words, AColumnThatAModelDoesNotUseMayBeAbsent) {
  const Folder folder;
  folder.write("d.csv", line_and_noise(200));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  folder.write("with.csv", "a,b\n0.25,0.5\n-0.5,1\n");
  folder.write("without.csv", "a\n0.25\n-0.5\n");
  const auto predictions = [&](const std::string& table) {
    const Outcome outcome = folder.run(llmt_program + " predict m.json " + table + " -o p.csv");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return llmt::Csv::read(folder.file("p.csv")).numbers("y_pred");
  };
  const Eigen::VectorXd with = predictions("with.csv");
  EXPECT_EQ(predictions("without.csv"), with);
  EXPECT_NEAR(with(0), 0.5, 1e-6);
  // One that it uses may not.
  folder.write("other.csv", "b\n0.25\n");
  EXPECT_EQ(refused_text(folder, "predict m.json other.csv", 1),
            "llmt: other.csv: there is no column \"a\"; the columns are b\n");
}

TEST(Words, ModelAndTableThatWereExchangedAreNamed) {
  const Folder folder;
  folder.write("d.csv", line_and_noise(30));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  for (const std::string command : {"predict", "explain"}) {
    EXPECT_EQ(refused_text(folder, command + " d.csv m.json", 2),
              "llmt: d.csv and m.json seem to be exchanged: the model (JSON) comes first, then the table (CSV)\n");
  }
  folder.write("words.txt", "no table\n");
  EXPECT_NE(refused_text(folder, "predict words.txt d.csv", 1).find("not JSON"), std::string::npos);
  for (const std::string command : {"predict d.csv d.csv", "inspect d.csv", "explain d.csv d.csv"}) {
    EXPECT_EQ(refused_text(folder, command, 1), "llmt: d.csv: this is a table; a model file (JSON) is expected\n");
  }
  for (const std::string command : {"fit m.json -t y", "predict m.json m.json", "compare m.json -t y"}) {
    EXPECT_EQ(refused_text(folder, command, 1), "llmt: m.json: this is a JSON file; a table (CSV) is expected\n");
  }
  EXPECT_EQ(refused_text(folder, "inspect m.json d.csv", 2),
            "llmt: The following argument was not expected: d.csv; usage: llmt inspect [OPTIONS] model\n");
}

TEST(Words, AHeaderOfNumbersIsTakenForARowAndSaid) {
  const Folder folder;
  const std::string warning =
      "llmt: d.csv: the first line holds only numbers and was taken for the names of the columns; if it is a row of "
      "data, put a line with names above it\n";
  folder.write("d.csv", "1.5,2,3\n2,3,4\n");
  EXPECT_EQ(refused_text(folder, "fit d.csv -t y", 1),
            warning + "llmt: d.csv: there is no column \"y\"; the columns are 1.5, 2, 3\n");
  folder.write("d.csv", "1,5;2;3\n2;3;4\n");
  EXPECT_EQ(refused_text(folder, "fit d.csv -t y --decimal-comma", 1).find(warning), 0U);
  // Numbers of columns are names.
  folder.write("d.csv", "0,1,2\n2,3,4\n");
  EXPECT_EQ(refused_text(folder, "fit d.csv -t y", 1),
            "llmt: d.csv: there is no column \"y\"; the columns are 0, 1, 2\n");
}

TEST(Words, ATargetIsNeitherIgnoredNorTheWeight) {
  const Folder folder;
  folder.write("d.csv", line_and_noise(30));
  EXPECT_EQ(refused_text(folder, "fit d.csv -t y --ignore y", 2), "llmt: column \"y\" is a target and ignored\n");
  EXPECT_EQ(refused_text(folder, "fit d.csv -t y --weight y", 2), "llmt: column \"y\" is a target and the weight\n");
}

TEST(Words, AllRowsWithoutATargetAreSaidAtOnce) {
  const Folder folder;
  folder.write("d.csv", "x,y\n1,\n2,2\n3,NA\n4,4\n5,?\n");
  EXPECT_EQ(refused_text(folder, "fit d.csv -t y", 1),
            "llmt: d.csv:2: column \"y\": the cell is empty, a number is needed; 3 rows have no number there, lines 2, "
            "4, 6: delete these lines or fill in the cells\n");
}

TEST(Words, AColumnOfWordsIsNoTarget) {
  const Folder folder;
  folder.write("d.csv", "material,x,w\nsteel,1,a\n,2,b\nwood,3,c\n");
  EXPECT_EQ(refused_text(folder, "fit d.csv -t material", 1),
            "llmt: d.csv: column \"material\" holds words; the target must be a number\n");
  EXPECT_EQ(refused_text(folder, "fit d.csv -t x --weight w", 1),
            "llmt: d.csv: column \"w\" holds words; the weight must be a number\n");
  EXPECT_EQ(
      refused_text(folder, "discover d.csv d.csv -t x", 1),
      "llmt: d.csv:2: column \"material\": 'steel' is not a number (--inputs COLUMN,... names the columns to use, "
      "and leaves out the others)\n");
}

TEST(Words, AColumnOfDatesIsCalledSo) {
  const Folder folder;
  const auto warning_of = [&](const std::vector<std::string>& words) {
    std::string text = "when,x,y\n";
    for (int i = 0; i < 60; ++i) text += fmt::format("{},{},{}\n", words[i % words.size()], i % 7, 2 * (i % 7));
    folder.write("d.csv", text);
    return folder.run(llmt_program + " fit d.csv -t y --cv 0").err;
  };
  const std::vector<std::vector<std::string>> dates = {{"2024-03-31", "2024-04-01", "2024-12-24"},
                                                       {"31.3.24", "1.4.24"},
                                                       {"3/31/2024 14:05", "4/1/2024 9:00"},
                                                       {"2024-03-31T12:00:00Z", "2024-04-01T12:00:00Z"}};
  for (const std::vector<std::string>& words : dates) {
    EXPECT_NE(warning_of(words).find("it looks like a date: leave it out (--ignore when) or give a number, as days"),
              std::string::npos)
        << words[0];
  }
  for (const std::string word : {"red", "2024-03", "1-2-3-4", "10.0.0.1", "v1.2.3", "2024-03-31x"}) {
    EXPECT_EQ(warning_of({word, "blue"}), "") << word;
    EXPECT_EQ(warning_of({"2024-03-31", word}), "") << word;
  }
}

TEST(Words, DatesOfManyDaysAreLeftOut) {
  const Folder folder;
  std::string with = "when,x,y\n";
  std::string without = "x,y\n";
  for (int i = 0; i < 90; ++i) {
    const std::string row = fmt::format("{},{}\n", (i * 37) % 90 / 10.0, 2 * ((i * 37) % 90) + i % 2);
    with += fmt::format("2024-{:02}-{:02},{}", i / 28 + 1, i % 28 + 1, row);
    without += row;
  }
  folder.write("with.csv", with);
  folder.write("without.csv", without);
  const Outcome fitted = folder.run(llmt_program + " fit with.csv -t y -o with.json");
  EXPECT_EQ(fitted.exit_code, 0);
  EXPECT_NE(
      fitted.err.find("column \"when\" has dates, 90 different ones in 90 rows, and is left out; give a number, as "
                      "days; --categorical takes it for categories"),
      std::string::npos)
      << fitted.err;
  folder.run(llmt_program + " fit without.csv -t y -o without.json");
  EXPECT_EQ(llmt::read_file(folder.file("with.json")), llmt::read_file(folder.file("without.json")));
  EXPECT_EQ(folder.run(llmt_program + " predict with.json with.csv").exit_code, 0);
  EXPECT_EQ(folder.run(llmt_program + " fit with.csv -t y --inputs when,x -o m.json").err.find("left out"),
            std::string::npos);
}

TEST(Words, ColumnsThatNumberTheRowsAreNamed) {
  const Folder folder;
  const auto names_it = [&](int rows, const std::function<int(int)>& id) {
    std::string text = "id,x,y\n";
    for (int i = 0; i < rows; ++i) text += fmt::format("{},{},{}\n", id(i), i % 7, 2 * (i % 7) + i % 3);
    folder.write("d.csv", text);
    return folder.run(llmt_program + " fit d.csv -t y --cv 0").err.find("column \"id\" numbers the rows") !=
           std::string::npos;
  };
  EXPECT_TRUE(names_it(30, [](int i) { return i; }));
  EXPECT_TRUE(names_it(30, [](int i) { return 100001 + i; }));
  EXPECT_TRUE(names_it(30, [](int i) { return 10 * i + 10; }));
  EXPECT_TRUE(names_it(30, [](int i) { return 3 * i + i * i % 3; }));
  EXPECT_TRUE(names_it(30, [](int i) { return 500 - 2 * i; }));
  EXPECT_TRUE(names_it(101, [](int i) { return 1000 + i * 37 % 101; }));  // in another order
  EXPECT_FALSE(names_it(97, [](int i) { return i * 37 % 97; }));          // of few rows that may be meant
  EXPECT_FALSE(names_it(101, [](int i) { return i * 37 % 101 / 2; }));    // twice each
  EXPECT_FALSE(names_it(30, [](int i) { return i - i % 2; }));
  EXPECT_FALSE(names_it(19, [](int i) { return i; }));
}

TEST(Words, EqualValuesFarFromAllOthersAreNamed) {
  const Folder folder;
  const auto said = [&](const std::string& value, int every) {
    std::string text = "x,z,y\n";
    for (int i = 0; i < 60; ++i) {
      const std::string cell = i % every == 1 ? value : fmt::format("{}", (i * 7) % 20 / 2.0);
      text += fmt::format("{},{},{}\n", cell, i % 11, 2 * (i % 11));
    }
    folder.write("d.csv", text);
    return folder.run(llmt_program + " fit d.csv -t y --cv 0").err;
  };
  EXPECT_EQ(
      said("-999", 7),
      "llmt: column \"x\": 9 of 60 cells are -999, far from all others (0 to 9.5); if they stand for missing values, "
      "empty these cells\n");
  EXPECT_NE(said("9999", 15).find("4 of 60 cells are 9999, far from all others (0 to 9.5)"), std::string::npos);
  EXPECT_EQ(said("-8", 7), "");     // not far
  EXPECT_EQ(said("-999", 40), "");  // two cells
}

TEST(Words, NumbersThatAreWrittenWithUnitsAreNamed) {
  const Folder folder;
  const auto said = [&](const std::function<std::string(int)>& cell) {
    std::string text = "x;price;y\n";
    for (int i = 0; i < 60; ++i) text += fmt::format("{};{};{}\n", i % 11, cell(i), 2 * (i % 11));
    folder.write("d.csv", text);
    const std::string err = folder.run(llmt_program + " fit d.csv -t y --cv 0").err;
    const std::size_t begin = err.find("every cell is ");
    return begin == std::string::npos ? "" : err.substr(begin + 14, err.find(", and is taken") - begin - 14);
  };
  EXPECT_EQ(said([](int i) { return fmt::format("{}.5 kg", i); }), "a number and \"kg\"");
  EXPECT_EQ(said([](int i) { return fmt::format("CHF 1'{}.5", 200 + i); }),
            "\"CHF\" and a number with apostrophes between thousands");
  EXPECT_EQ(said([](int i) { return fmt::format("\u20ac {}", i); }), "\"\u20ac\" and a number");
  EXPECT_EQ(said([](int i) { return fmt::format("1\u202f{},50", 200 + i); }), "a number with blanks between thousands");
  EXPECT_EQ(said([](int i) { return fmt::format("{}%", i); }), "a number and \"%\"");
  EXPECT_EQ(said([](int i) { return fmt::format("P{}", i % 9); }), "");
  EXPECT_EQ(said([](int i) { return fmt::format("shop {}", i % 9); }), "");
}

TEST(Words, TablesOfErrorsHaveTheMeanOfTheRows) {
  const Folder folder;
  folder.write("d.csv", line_and_noise(60));
  for (const char* command : {"fit d.csv -t y", "fit d.csv -t y --boost", "compare d.csv -t y"}) {
    EXPECT_NE(folder.run(llmt_program + " " + command).out.find("mean of the rows"), std::string::npos) << command;
  }
}

TEST(Words, AFitThatIsNotWrittenSaysSo) {
  const Folder folder;
  folder.write("d.csv", line_and_noise(60));
  const std::string fit = llmt_program + " fit d.csv -t y";
  EXPECT_TRUE(folder.run(fit + " --readable").out.ends_with("Not written: give -o FILE.json\n"));
  EXPECT_EQ(folder.run(fit + " -o m.json").out.find("Not written"), std::string::npos);
  EXPECT_EQ(folder.run(fit + " --json").out.find("Not written"), std::string::npos);
}

TEST(Words, OneIsSingular) {
  const Folder folder;
  folder.write("d.csv", "x,y\n1,1\n2,2\n3,3\n4,4.1\n5,5\n");
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --cv 0 -o m.json");
  EXPECT_NE(fitted.out.find("5 rows, 1 input: x"), std::string::npos) << fitted.out;
  const std::string text = folder.run(llmt_program + " inspect m.json").out;
  EXPECT_NE(text.find("1 input, 1 output\n"), std::string::npos) << text;
  EXPECT_NE(text.find("y: 1 leaf\n"), std::string::npos) << text;
}

TEST(Words, ADefaultOfManyWordsIsInTheLongHelp) {
  const Folder folder;
  const auto help_has = [&](const char* help, const char* text) {
    return folder.run(llmt_program + " fit " + help).out.find(text) != std::string::npos;
  };
  EXPECT_TRUE(help_has("--help", "[chosen from rows and method, see"));
  EXPECT_FALSE(help_has("--help", "1500 / coefficients"));
  EXPECT_TRUE(help_has("--help-all", "1500 /"));
}

TEST(Words, AValueThatNeedsAnEqualsSignIsShownWithIt) {
  const Folder folder;
  folder.write("d.csv", line_and_noise(30));
  EXPECT_EQ(refused_text(folder, "fit d.csv -t y --readable 5", 2),
            "llmt: The following argument was not expected: 5; a value of --readable is written --readable=5\n");
}

TEST(Words, ANameThatIsNotWrittenOutIsCompleted) {
  const std::vector<std::string> names = {"humidity_percent", "outdoor_C", "outlet_C"};
  EXPECT_EQ(llmt::closest_name("humid", names), "humidity_percent");
  EXPECT_EQ(llmt::closest_name("OUTD", names), "outdoor_C");
  EXPECT_EQ(llmt::closest_name("out", names), "");  // two begin so
  EXPECT_EQ(llmt::closest_name("hu", names), "");   // too short
  EXPECT_EQ(llmt::closest_name("midity", names), "");
  const std::vector<std::string> letters = {"x", "y"};
  EXPECT_EQ(llmt::closest_name("Y", letters), "y");
  EXPECT_EQ(llmt::closest_name("z", letters), "");
  const Folder folder;
  folder.write("d.csv", "humidity_percent,y\n1,2\n");
  EXPECT_EQ(refused_text(folder, "fit d.csv -t y --ignore humid", 1),
            "llmt: d.csv: there is no column \"humid\" (did you mean \"humidity_percent\"?); the columns are "
            "humidity_percent, y\n");
}

TEST(Words, ASmallerErrorThatIsNotBetterByMoreThanChanceIsExplained) {
  const Folder folder;
  int explained = 0;
  folder.write("line.csv", line_and_noise(60));
  const std::vector<std::string> fits = {"line.csv -t y", LLMT_DOCS "/samples/heat_pump.csv -t cop --cv 3",
                                         LLMT_DOCS "/samples/heat_pump.csv -t cop --cv 3 --validity crisp"};
  for (const std::string& fit : fits) {
    const Outcome printed = folder.run(llmt_program + " fit " + fit);
    const json summary = json::parse(folder.run(llmt_program + " fit " + fit + " --json").out);
    bool has_smaller = false;
    for (const json& partition : summary["partitions"]) {
      for (const json& other : partition["compared"]) {
        const json& error = other["cv_rmse"];
        has_smaller = has_smaller || (error.is_number() && error.get<double>() < partition["cv_rmse"].get<double>());
      }
    }
    const bool is_said =
        printed.out.find("A model with a smaller error is not better by more than chance") != std::string::npos;
    EXPECT_EQ(is_said, has_smaller) << fit;
    explained += is_said ? 1 : 0;
  }
  EXPECT_GT(explained, 0);
  EXPECT_LT(explained, 3);
}

}  // namespace
