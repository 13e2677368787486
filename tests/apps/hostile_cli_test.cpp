// The program with tables and models that it did not write.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/programs.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::llmt_program;
using program::Outcome;

std::string table_of_words(const std::string& input, const std::string& category, const std::string& target) {
  std::string text = input + ",kind," + target + "\n";
  for (int i = 0; i < 40; ++i) {
    text += fmt::format("{},{},{}\n", i, i % 2 == 0 ? "red" : i > 20 ? category : "green", i * i % 17);
  }
  return text;
}

TEST(HostileTables, NamesThatAreNotUtf8AreRefusedBeforeTheFit) {
  const Folder folder;
  const std::string latin = "h\xF6he";
  folder.write("name.csv", table_of_words(latin, "blue", "y"));
  folder.write("target.csv", table_of_words("x", "blue", latin));
  folder.write("level.csv", table_of_words("x", latin, "y"));
  folder.write("unused.csv", table_of_words(latin, "blue", "y"));
  for (const char* options : {"", "--json", "-o m.json", "--stream --ignore kind"}) {
    const Outcome name = folder.run(llmt_program + " fit name.csv -t y " + options);
    EXPECT_EQ(name.exit_code, 1);
    EXPECT_EQ(name.err,
              "llmt: name.csv:1: byte 0xf6 of the name of column 1 of the header is not UTF-8; a file of Windows is "
              "converted by iconv -f CP1252 -t UTF-8\n");
  }
  EXPECT_NE(folder.run(llmt_program + " fit target.csv -t '" + latin + "'").err.find("the name of column 3"),
            std::string::npos);
  EXPECT_EQ(
      folder.run(llmt_program + " fit level.csv -t y --json").err,
      "llmt: level.csv:23: column \"kind\": byte 0xf6 of the cell is not UTF-8; a file of Windows is converted by "
      "iconv -f CP1252 -t UTF-8\n");
  EXPECT_EQ(folder.run(llmt_program + " fit unused.csv -t y --ignore '" + latin + "' --cv 0").exit_code, 1);
}

TEST(HostileTables, TheNameOfAFileMayBeAnything) {
  const Folder folder;
  folder.write("t\xF6.csv", table_of_words("x", "blue", "y"));
  const Outcome fitted = folder.run(llmt_program + " fit t\xF6.csv -t y --cv 0 --json");
  EXPECT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_TRUE(json::accept(fitted.out));
}

TEST(HostileModels, PredictionsThatAreNotFiniteAreCountedAndSaid) {
  const Folder folder;
  folder.write("t.csv", "x,y\n0,1\n1,2\n2,3\n3,4\n4,5\n5,6\n6,7\n7,8\n");
  ASSERT_EQ(folder.run(llmt_program + " fit t.csv -t y --cv 0 -o m.json").exit_code, 0);
  json model = json::parse(llmt::read_file(folder.file("m.json")));
  model["partitions"][0]["outer_slope"] = {{1e308}};
  folder.write("steep.json", model.dump());
  folder.write("q.csv", "x,y\n1,2\n300,0\n-500,0\n");
  const Outcome predicted = folder.run(llmt_program + " predict steep.json q.csv --json");
  EXPECT_EQ(predicted.exit_code, 0);
  EXPECT_NE(predicted.err.find("2 of 3 predictions are not finite: numbers of steep.json are too large"),
            std::string::npos)
      << predicted.err;
  const json said = json::parse(predicted.out);
  EXPECT_EQ(said["not_finite_predictions"], 2);
  EXPECT_TRUE(said["targets"][0]["rmse"].is_null());
  EXPECT_TRUE(said["targets"][0]["predicted"][1].is_null());
  const Outcome explained = folder.run(llmt_program + " explain steep.json q.csv --json");
  EXPECT_NE(explained.err.find("importances are not finite"), std::string::npos) << explained.err;
  EXPECT_TRUE(json::accept(explained.out));
}

// Sanitizers reserve more address space than this.
#if !defined(__SANITIZE_ADDRESS__)
TEST(HostileModels, AFileThatNeedsMoreMemoryThanThereIsIsNamed) {
  const Folder folder;
  std::string text = "{\"format\":[";
  for (int i = 0; i < 5'000'000; ++i) text += "1,";
  folder.write("big.json", text + "1]}");
  const Outcome outcome = folder.run("ulimit -v 200000; " + llmt_program + " inspect big.json");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err, "llmt: big.json: there is not enough memory for this\n");
}
#endif

TEST(HostileModels, IntervalsOfAnotherModelPrintNothing) {
  const Folder folder;
  std::string text = "x,y,z\n";
  for (int i = 0; i < 60; ++i) text += fmt::format("{},{},{}\n", i, i % 7, i % 5);
  folder.write("t.csv", text);
  ASSERT_EQ(folder.run(llmt_program + " fit t.csv -t y,z -o two.json").exit_code, 0);
  ASSERT_EQ(folder.run(llmt_program + " fit t.csv -t y --ignore z -o one.json").exit_code, 0);
  json model = json::parse(llmt::read_file(folder.file("two.json")));
  model["intervals"] = json::parse(llmt::read_file(folder.file("one.json")))["intervals"];
  model.erase("training");  // which is refused for another model first
  folder.write("mixed.json", model.dump());
  const Outcome outcome = folder.run(llmt_program + " predict mixed.json t.csv --interval 0.5");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err.find("llmt: mixed.json: /intervals: the intervals belong to another model: fold 0"), 0U);
}

}  // namespace
