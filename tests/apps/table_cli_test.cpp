// `llmt table`, and `llmt fit` and `llmt predict` of tables larger than memory.
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/files.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

std::string kinked_table(int rows, std::uint64_t seed) {
  llmt::Random random(seed);
  std::string text = "a,b,y\n";
  for (int i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", a, random.uniform(-1.0, 1.0), 2.0 * std::abs(a) + 0.05 * random.normal());
  }
  return text;
}

const std::string program_path = LLMT_PROGRAM;

TEST(TableProgram, ATableThatFitsGivesTheModelOfItsCsvFile) {
  const Folder folder;
  const std::string first = kinked_table(1500, 1);
  const std::string second = kinked_table(1500, 2);
  folder.write("a.csv", first);
  folder.write("b.csv", second);
  folder.write("both.csv", first + second.substr(second.find('\n') + 1));
  ASSERT_EQ(folder.run(program_path + " table a.csv b.csv -o d.arrow").exit_code, 0);
  ASSERT_EQ(folder.run(program_path + " fit d.arrow -t y -o arrow.json").exit_code, 0);
  ASSERT_EQ(folder.run(program_path + " fit both.csv -t y -o csv.json").exit_code, 0);
  EXPECT_EQ(llmt::read_file(folder.file("arrow.json")), llmt::read_file(folder.file("csv.json")));
}

// The first rows of a CSV text, with other columns: `change` gets the row's cells.
std::string rows_of(const std::string& text, int count, const std::string& header, const auto& change) {
  std::string rows = header + "\n";
  std::size_t at = text.find('\n') + 1;
  for (int row = 0; row < count; ++row) {
    const std::size_t end = text.find('\n', at);
    rows += change(text.substr(at, end - at), row) + "\n";
    at = end + 1;
  }
  return rows;
}

TEST(TableProgram, SeveralFilesAreOneTable) {
  const Folder folder;
  const std::string first = kinked_table(900, 1);
  const std::string second = kinked_table(700, 2);
  folder.write("a.csv", first);
  folder.write("b.csv", second);
  folder.write("both.csv", first + second.substr(second.find('\n') + 1));
  ASSERT_EQ(folder.run(program_path + " table a.csv -o a.arrow").exit_code, 0);
  ASSERT_EQ(folder.run(program_path + " table b.csv -o b.arrow").exit_code, 0);
  ASSERT_EQ(folder.run(program_path + " fit both.csv -t y -o whole.json").exit_code, 0);
  for (const char* files : {"a.arrow b.arrow", "a.csv b.csv", "a.arrow b.csv"}) {
    const Outcome fit = folder.run(fmt::format("{} fit {} -t y -o parts.json", program_path, files));
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    EXPECT_EQ(llmt::read_file(folder.file("parts.json")), llmt::read_file(folder.file("whole.json"))) << files;
    const Outcome predict = folder.run(fmt::format("{} predict whole.json {} -o parts.csv", program_path, files));
    ASSERT_EQ(predict.exit_code, 0) << predict.err;
    EXPECT_NE(predict.err.find("1600 rows of "), std::string::npos) << predict.err;
    ASSERT_EQ(folder.run(program_path + " predict whole.json both.csv -o whole.csv").exit_code, 0);
    EXPECT_EQ(llmt::Csv::read(folder.file("parts.csv")).numbers("y_pred"),
              llmt::Csv::read(folder.file("whole.csv")).numbers("y_pred"));
  }
  // Arrow files are joined, too, and every third row is taken across them.
  ASSERT_EQ(folder.run(program_path + " table a.arrow b.csv -o both.arrow --every 3").exit_code, 0);
  folder.write("third.csv", rows_of(llmt::read_file(folder.file("both.csv")), 1600, "a,b,y",
                                    [](const std::string& cells, int row) { return row % 3 == 0 ? cells : ""; }));
  ASSERT_EQ(folder.run(program_path + " fit both.arrow -t y -o arrow.json").exit_code, 0);
  ASSERT_EQ(folder.run(program_path + " fit third.csv -t y -o csv.json").exit_code, 0);
  EXPECT_EQ(llmt::read_file(folder.file("arrow.json")), llmt::read_file(folder.file("csv.json")));
}

TEST(TableProgram, ComparesAndWeighsRowsAsInACsvFile) {
  const Folder folder;
  folder.write("d.csv", rows_of(kinked_table(400, 5), 400, "a,b,y,w", [](const std::string& cells, int row) {
                 return fmt::format("{},{}", cells, row % 3);
               }));
  ASSERT_EQ(folder.run(program_path + " table d.csv -o d.arrow").exit_code, 0);
  ASSERT_EQ(folder.run(program_path + " fit d.csv -t y --weight w -o csv.json").exit_code, 0);
  const Outcome fit = folder.run(program_path + " fit d.arrow -t y --weight w -o arrow.json");
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_EQ(llmt::read_file(folder.file("arrow.json")), llmt::read_file(folder.file("csv.json")));
  const auto compared = [&](const std::string& data) {
    const Outcome outcome = folder.run(program_path + " compare " + data + " -t y --weight w --cv 2 --json");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json::parse(outcome.out)["methods"];
  };
  json of_csv = compared("d.csv");
  json of_arrow = compared("d.arrow");
  ASSERT_GT(of_csv.size(), 3);
  for (json* methods : {&of_csv, &of_arrow}) {
    for (json& method : *methods) {
      for (const char* time : {"fit_seconds", "predict_seconds_per_million_rows"}) EXPECT_EQ(method.erase(time), 1);
    }
  }
  EXPECT_EQ(of_arrow, of_csv);
}

TEST(TableProgram, AFitGoesOnFromItsCheckpointAndItsModelPredicts) {
  const Folder folder;
  folder.write("d.csv", kinked_table(6000, 3));
  ASSERT_EQ(folder.run(program_path + " table d.csv -o d.arrow").exit_code, 0);
  const std::string fit = program_path + " fit d.arrow -t y --memory 200K --validity crisp --json ";
  const Outcome whole = folder.run(fit + "--checkpoint state -o whole.json");
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_GE(json::parse(whole.out)["top_leaves"], 2);
  // The last state has the model: nothing is left to do.
  ASSERT_EQ(folder.run(fit + "--checkpoint state --resume --threads 2 -o again.json").exit_code, 0);
  EXPECT_EQ(llmt::read_file(folder.file("again.json")), llmt::read_file(folder.file("whole.json")));
  const Outcome other = folder.run(fit + "--checkpoint state --resume --max-leaves 3");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.err.find("state: is of a fit of other columns"), std::string::npos) << other.err;
  ASSERT_EQ(folder.run(program_path + " predict whole.json d.arrow -o arrow.csv").exit_code, 0);
  ASSERT_EQ(folder.run(program_path + " predict whole.json d.csv -o csv.csv").exit_code, 0);
  EXPECT_EQ(llmt::Csv::read(folder.file("arrow.csv")).numbers("y_pred"),
            llmt::Csv::read(folder.file("csv.csv")).numbers("y_pred"));
}

TEST(TableProgram, WhatIsNotPossibleIsNamed) {
  const Folder folder;
  folder.write("d.csv", kinked_table(100, 4));
  folder.write("e.csv", "a,y\n1,2\n");
  const auto says = [&](const std::string& arguments, int exit_code, const char* text) {
    const Outcome outcome = folder.run(program_path + " " + arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  };
  says("table d.csv e.csv -o d.arrow", 1, "e.csv: the columns are a, y");
  ASSERT_EQ(folder.run(program_path + " table d.csv -o d.arrow").exit_code, 0);
  says("fit d.arrow", 2, "the columns of d.arrow are a, b, y");
  says("fit d.arrow -t y --rule m5", 2, "is not possible beyond one memory");
  says("fit d.arrow -t y --memory 4", 2, "4G");
  says("fit d.arrow -t y --resume", 2, "--checkpoint");
  says("fit d.csv -t y --memory 4G", 2, "--memory is for Arrow files");
  says("fit d.arrow -t y --memory infG", 2, "4G");
  says("fit d.arrow -t y --memory 1K", 2, "3 columns need at least 16K");
  says("table d.csv -o d.csv", 2, "d.csv");
}

TEST(TableProgram, TheFileAndTheRowOfWhatIsWrongAreNamed) {
  const Folder folder;
  const std::string text = kinked_table(100, 6);
  const auto arrow = [&](const std::string& name, const std::string& csv) {
    folder.write("part.csv", csv);
    ASSERT_EQ(folder.run(program_path + " table part.csv -o " + name).exit_code, 0);
  };
  const auto same = [](const std::string& cells, int) { return cells; };
  arrow("whole.arrow", text);
  arrow("hole.arrow", rows_of(text, 50, "a,b,y", [](const std::string& cells, int row) {
          return row == 16 ? cells.substr(0, cells.rfind(',') + 1) : cells;
        }));
  arrow("other.arrow", rows_of(text, 50, "a,c,y", same));
  arrow("huge.arrow", rows_of(text, 50, "a,b,y", [](const std::string& cells, int row) {
          return row == 9 ? "1e200" + cells.substr(cells.find(',')) : cells;
        }));
  folder.write("words.csv", "a,b,y\n1,2,3\n4,five,6\n");
  const auto says = [&](const std::string& arguments, const char* text_of_error) {
    const Outcome outcome = folder.run(program_path + " " + arguments + " -o none.json");
    EXPECT_EQ(outcome.exit_code, 1) << arguments;
    EXPECT_NE(outcome.err.find(text_of_error), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder.file("none.json")));
  };
  says("fit whole.arrow hole.arrow -t y", "hole.arrow: row 17: column \"y\": is missing");
  says("fit whole.arrow other.arrow -t y", "other.arrow: there is no column \"b\", which whole.arrow has");
  says("fit whole.arrow huge.arrow -t y", "huge.arrow: row 10: column \"a\": 1e+200 is beyond");
  says("fit whole.arrow words.csv -t y", "words.csv:3: column \"b\": 'five' is not a number");
  says("fit whole.arrow nowhere.arrow -t y", "nowhere.arrow: cannot be read");
  ASSERT_EQ(folder.run(program_path + " fit whole.arrow -t y -o model.json").exit_code, 0);
  says("predict model.json whole.arrow other.arrow", "other.arrow: there is no column \"b\"");
}

TEST(TableProgram, AColumnThatTheModelDoesNotUseMayBeMissing) {
  const Folder folder;
  const std::string text = kinked_table(300, 7);
  folder.write("d.csv", rows_of(text, 300, "a,b,y,c", [](const std::string& cells, int) { return cells + ",1"; }));
  folder.write("asked.csv", text);
  for (const char* name : {"d", "asked"}) {
    ASSERT_EQ(folder.run(fmt::format("{0} table {1}.csv -o {1}.arrow", program_path, name)).exit_code, 0);
  }
  ASSERT_EQ(folder.run(program_path + " fit d.arrow -t y -o model.json").exit_code, 0);
  for (const char* name : {"asked.csv", "asked.arrow"}) {
    const Outcome outcome = folder.run(fmt::format("{} predict model.json {} -o {}.out", program_path, name, name));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  EXPECT_EQ(llmt::Csv::read(folder.file("asked.arrow.out")).numbers("y_pred"),
            llmt::Csv::read(folder.file("asked.csv.out")).numbers("y_pred"));
}

}  // namespace
