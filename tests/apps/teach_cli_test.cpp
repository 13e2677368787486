#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"
#include "llmt/teach.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

std::string kinked(int rows) {
  llmt::Random random(1);
  std::string text = "a,b,y\n";
  for (int i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", a, b, std::abs(a) * b + 0.2 * random.normal());
  }
  return text;
}

TEST(TeachProgram, FitsAsTheLibraryAndSaysWhatTeachingBrought) {
  const Folder folder;
  folder.write("d.csv", kinked(150));
  const Outcome fitted = folder.run(LLMT_PROGRAM " fit d.csv -t y --teach -o m.json --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const llmt::Csv csv = llmt::Csv::parse(kinked(150), "d.csv");
  llmt::TrainingData data{Eigen::MatrixXd(150, 2), csv.numbers("y")};
  data.inputs << csv.numbers("a"), csv.numbers("b");
  data.input_names = {"a", "b"};
  data.output_names = {"y"};
  const llmt::TaughtResult taught = llmt::fit_taught(data);
  std::ifstream file(folder.file("m.json"));
  const std::string written{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(to_json(taught.fit.model, taught.fit.intervals), written);
  const json summary = json::parse(fitted.out)["teaching"];
  EXPECT_EQ(summary["taken"], taught.is_taken);
  EXPECT_EQ(summary["made_rows"], 600);
  EXPECT_EQ(summary["partitions"][0]["targets"], json({"y"}));
  EXPECT_EQ(summary["partitions"][0]["cv_rmse_alone"], taught.partitions[0].alone);
  EXPECT_EQ(summary["partitions"][0]["cv_rmse_taught"], taught.partitions[0].taught);
  EXPECT_EQ(summary["partitions"][0]["cv_rmse_sum"], taught.partitions[0].teacher);
}

TEST(TeachProgram, RefusesByNameWhatItDoesNotGoWith) {
  const Folder folder;
  folder.write("d.csv", kinked(60));
  for (const std::string other : {"--boost", "--stream", "--cv 0"}) {
    const Outcome outcome = folder.run(LLMT_PROGRAM " fit d.csv -t y --teach " + other);
    EXPECT_NE(outcome.exit_code, 0) << other;
    EXPECT_NE(outcome.err.find("--teach"), std::string::npos) << outcome.err;
  }
}

}  // namespace
