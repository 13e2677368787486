// Is a model still good? From two tables to an exit code.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/programs.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::llmt_program;
using program::Outcome;

struct Drawn {
  int rows = 300;
  std::uint64_t seed = 1;
  double noise = 0.1;
  double shift = 0.0;          // of the load
  const char* auto_ = "auto";  // what the third mode is called
  bool has_target = true;
};

std::string table(const Drawn& drawn) {
  llmt::Random random(drawn.seed);
  std::string text = drawn.has_target ? "load,power,mode,cop\n" : "load,power,mode\n";
  for (int i = 0; i < drawn.rows; ++i) {
    const double load = 10.0 * random.uniform() + drawn.shift;
    const double power = random.normal();
    const int mode = static_cast<int>(random.below(3));
    text += fmt::format("{},{},{}", load, power, mode == 0 ? "eco" : mode == 1 ? "off" : drawn.auto_);
    if (drawn.has_target) {
      text += fmt::format(",{}", (load < 5.0 ? load : 8.0 - power) + 0.5 * mode + drawn.noise * random.normal());
    }
    text += '\n';
  }
  return text;
}

void fit(const Folder& folder, const std::string& options = "") {
  folder.write("t.csv", table({.rows = 500}));
  const Outcome fitted = folder.run(llmt_program + " fit t.csv -t cop -o m.json" + options);
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
}

TEST(TableCheckProgram, ExitCodesSayWhetherAModelIsGood) {
  const Folder folder;
  for (const char* options : {"", " --boost"}) {
    fit(folder, options);
    folder.write("new.csv", table({.seed = 2}));
    const Outcome good = folder.run(llmt_program + " check m.json new.csv");
    EXPECT_EQ(good.exit_code, 0) << good.err << good.out;
    EXPECT_NE(good.out.find("\nGOOD.\n"), std::string::npos) << good.out;
    EXPECT_NE(good.out.find("the file promises"), std::string::npos) << good.out;
    EXPECT_TRUE(good.err.empty()) << good.err;
    folder.write("noisy.csv", table({.seed = 3, .noise = 0.25}));
    const Outcome bad = folder.run(llmt_program + " check m.json noisy.csv");
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_NE(bad.out.find("NO LONGER GOOD."), std::string::npos) << bad.out;
    EXPECT_NE(bad.err.find("noisy.csv: the RMSE of cop is 0.2"), std::string::npos) << bad.err;
    const Outcome stated = folder.run(llmt_program + " check m.json noisy.csv --max-error 0.5");
    EXPECT_EQ(stated.exit_code, 3) << stated.out;
    EXPECT_NE(stated.out.find("fewer than chance explains"), std::string::npos) << stated.out;
    EXPECT_NE(stated.out.find("MOVED, WITHIN LIMITS."), std::string::npos) << stated.out;
    EXPECT_NE(stated.out.find("good up to 0.5000, as stated"), std::string::npos) << stated.out;
  }
}

TEST(TableCheckProgram, AnUnknownCategoryIsNamedWithWhatItMayMean) {
  const Folder folder;
  fit(folder);
  folder.write("new.csv", table({.seed = 2, .auto_ = "AUTO"}));
  const Outcome found = folder.run(llmt_program + " check m.json new.csv --max-error 9");
  EXPECT_EQ(found.exit_code, 3) << found.err;
  EXPECT_NE(found.out.find("mode: AUTO in "), std::string::npos) << found.out;
  EXPECT_NE(found.out.find("rows (did you mean \"auto\"?)"), std::string::npos) << found.out;
  const json parsed = json::parse(folder.run(llmt_program + " check m.json new.csv --max-error 9 --json").out);
  EXPECT_EQ(parsed["verdict"], "moved, within limits");
  EXPECT_EQ(parsed["inputs"][2]["unknown_words"]["AUTO"], parsed["inputs"][2]["unknown"]);
  EXPECT_GT(parsed["inputs"][2]["unknown"], 50);
}

TEST(TableCheckProgram, AnInputThatMovedIsNamed) {
  const Folder folder;
  fit(folder);
  folder.write("new.csv", table({.seed = 2, .shift = 2.0}));
  const Outcome found = folder.run(llmt_program + " check m.json new.csv --max-error 9");
  EXPECT_EQ(found.exit_code, 3) << found.err;
  EXPECT_NE(found.out.find("Inputs that are not as in training"), std::string::npos) << found.out;
  EXPECT_NE(found.out.find("load *"), std::string::npos) << found.out;
  EXPECT_NE(found.out.find("above the range of training"), std::string::npos) << found.out;
}

TEST(TableCheckProgram, WhatCannotBeJudgedHasACodeOfItsOwn) {
  const Folder folder;
  fit(folder);
  folder.write("inputs.csv", table({.seed = 2, .has_target = false}));
  const Outcome without = folder.run(llmt_program + " check m.json inputs.csv");
  EXPECT_EQ(without.exit_code, 4);
  EXPECT_NE(without.out.find("NOT EVALUATED: no row has a value of the target."), std::string::npos) << without.out;
  folder.write("few.csv", table({.rows = 5, .seed = 2}));
  EXPECT_EQ(folder.run(llmt_program + " check m.json few.csv").exit_code, 4);
  folder.write("empty.csv", "load,power,mode,cop\n");
  const Outcome empty = folder.run(llmt_program + " check m.json empty.csv");
  EXPECT_EQ(empty.exit_code, 4);
  EXPECT_NE(empty.err.find("empty.csv: there is a header and no rows"), std::string::npos) << empty.err;
  folder.write("nothing.csv", "");
  const Outcome nothing = folder.run(llmt_program + " check m.json nothing.csv");
  EXPECT_EQ(nothing.exit_code, 4);
  EXPECT_NE(nothing.err.find("nothing.csv: the file is empty, a header row is needed"), std::string::npos);
  const Outcome json_of = folder.run(llmt_program + " check m.json inputs.csv --json");
  EXPECT_EQ(json_of.exit_code, 4);
  EXPECT_EQ(json::parse(json_of.out)["targets"][0]["rmse"], nullptr);
  fit(folder, " --no-intervals");
  folder.write("new.csv", table({.seed = 2}));
  EXPECT_EQ(folder.run(llmt_program + " check m.json new.csv").exit_code, 4);
  EXPECT_EQ(folder.run(llmt_program + " check m.json new.csv --max-error 0.5").exit_code, 0);
}

TEST(TableCheckProgram, WrongInputIsRefusedByName) {
  const Folder folder;
  fit(folder);
  folder.write("missing.csv", "load,power,cop\n1,2,3\n");
  const Outcome missing = folder.run(llmt_program + " check m.json missing.csv");
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.err.find("mode"), std::string::npos) << missing.err;
  folder.write("word.csv", "load,power,mode,cop\n1,2,eco,high\n");
  const Outcome word = folder.run(llmt_program + " check m.json word.csv");
  EXPECT_EQ(word.exit_code, 1);
  EXPECT_NE(word.err.find("word.csv:2: column \"cop\""), std::string::npos) << word.err;
  const Outcome limits = folder.run(llmt_program + " check m.json t.csv --max-error 1,2");
  EXPECT_EQ(limits.exit_code, 2);
  EXPECT_NE(limits.err.find("--max-error has 2 numbers, the model has 1 targets"), std::string::npos) << limits.err;
  const Outcome exchanged = folder.run(llmt_program + " check t.csv m.json");
  EXPECT_EQ(exchanged.exit_code, 2);
  EXPECT_NE(exchanged.err.find("the model (JSON) comes first"), std::string::npos) << exchanged.err;
  EXPECT_EQ(folder.run(llmt_program + " check m.json t.csv > /dev/full").exit_code, 1);
}

TEST(TableCheckProgram, AFileWithoutARecordSaysSo) {
  const Folder folder;
  fit(folder);
  json model = json::parse(llmt::read_file(folder.file("m.json")));
  ASSERT_TRUE(model.contains("training"));
  model.erase("training");
  folder.write("m.json", model.dump());
  folder.write("new.csv", table({.seed = 2}));
  const Outcome found = folder.run(llmt_program + " check m.json new.csv");
  EXPECT_EQ(found.exit_code, 0) << found.err << found.out;
  EXPECT_NE(found.out.find("The file has no record of its training rows"), std::string::npos) << found.out;
}

}  // namespace
