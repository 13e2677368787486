// `llmt table`, and `llmt fit` and `llmt predict` of tables larger than memory.
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
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
}

}  // namespace
