#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

const std::string llmt_program = LLMT_PROGRAM;

/// 300 rows: y has a kink in `a`, z is affine, `label` is words.
std::string table() {
  llmt::Random random(1);
  std::string text = "label,a,b,y,z\n";
  for (int i = 0; i < 300; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(0.0, 100.0);
    text += fmt::format("row {},{},{},{},{}\n", i, a, b, std::abs(a) + 0.01 * b + 0.01 * random.normal(), 2.0 * a - b);
  }
  return text;
}

TEST(LlmtProgram, FitPredictInspectAgreeWithTheLibrary) {
  const Folder folder;
  const llmt::Csv csv = llmt::Csv::read(folder.write("d.csv", table()));
  const Outcome fitted = folder.run(llmt_program + " fit d.csv --target y --target z --ignore label -o m.json --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_EQ(fitted.err, "");
  const json summary = json::parse(fitted.out);
  EXPECT_GT(summary["partitions"][0]["leaves"], 1);
  EXPECT_LT(summary["partitions"][0]["cv_rmse"], 0.02);
  EXPECT_GT(summary["partitions"][0]["cv_rmse_least_squares"], 0.2);
  EXPECT_EQ(summary["partitions"][1]["leaves"], 1);

  const Eigen::MatrixXd inputs = csv.numbers(std::vector<std::string>{"a", "b"});
  const Eigen::MatrixXd expected =
      llmt::fit(inputs, csv.numbers(std::vector<std::string>{"y", "z"})).model.predict(inputs);
  const Outcome predicted = folder.run(llmt_program + " predict m.json d.csv -o p.csv");
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  const llmt::Csv result = llmt::Csv::read(folder.file("p.csv"));
  EXPECT_EQ(result.columns(),
            (std::vector<std::string>{"label", "a", "b", "y", "z", "y_pred", "z_pred", "outside", "outside_by"}));
  EXPECT_EQ(result.numbers(std::vector<std::string>{"y_pred", "z_pred"}), expected);
  EXPECT_EQ(result.numbers("outside").sum(), 0.0);
  EXPECT_TRUE(result.row_text(7).starts_with("row 7,"));

  const Outcome inspected = folder.run(llmt_program + " inspect m.json --json");
  ASSERT_EQ(inspected.exit_code, 0) << inspected.err;
  EXPECT_EQ(json::parse(inspected.out)["partitions"][0]["leaves"].size(), summary["partitions"][0]["leaves"]);
  EXPECT_NE(folder.run(llmt_program + " inspect m.json").out.find("everywhere"), std::string::npos);
}

TEST(LlmtProgram, QueriesOutsideTheTrainingExtentAreFlagged) {
  const Folder folder;
  folder.write("d.csv", "x,y\n0,0\n1,1\n2,2\n3,3\n4,4\n");
  folder.write("q.csv", "other,x\nfar,6\nin,2\n");
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  const Outcome predicted = folder.run(llmt_program + " predict m.json q.csv");
  EXPECT_EQ(predicted.out, "other,x,y_pred,outside,outside_by\nfar,6,6,1,0.5\nin,2,2,0,0\n");
  EXPECT_NE(predicted.err.find("1 rows lie outside"), std::string::npos);
}

TEST(LlmtProgram, MistakesHaveTheirExitCodeAndMessage) {
  const Folder folder;
  folder.write("d.csv", table());
  folder.write("h.csv", "a,y\n");
  folder.write("cut.csv", "a,y\n1,2\n3");
  const auto expect = [&](const std::string& arguments, int code, const std::string& message) {
    const Outcome outcome = folder.run(llmt_program + " " + arguments);
    EXPECT_EQ(outcome.exit_code, code) << arguments;
    EXPECT_EQ(outcome.out, "") << arguments;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments << ": " << outcome.err;
  };
  expect("", 2, "subcommand");
  expect("fit d.csv", 2, "--target is required");
  expect("fit d.csv -t y --rule m5", 2, "m5");
  expect("fit d.csv -t y --ignore label --cv 1", 2, "folds.count is 1");
  expect("fit d.csv -t y", 1,
         "d.csv:2: column \"label\": 'row 0' is not a number (--ignore COLUMN leaves a column out)");
  expect("fit d.csv -t w", 1, "there is no column \"w\"; the columns are label, a, b, y, z");
  expect("fit h.csv -t y", 1, "h.csv: there is a header and no rows");
  expect("fit cut.csv -t y", 1, "cut.csv:3: the row has 1 field, the header has 2 (is the file cut off?)");
  expect("fit missing.csv -t y", 1, "missing.csv: cannot be read: No such file or directory");
  expect("fit d.csv -t y --ignore label -o no/m.json", 1, "no/m.json: cannot be written");
  expect("predict d.csv d.csv", 1, "d.csv: not JSON");
  EXPECT_EQ(folder.run(llmt_program + " fit --help").exit_code, 0);
}

TEST(LlmtProgram, AFailedWriteKeepsTheOldModel) {
  const Folder folder;
  folder.write("d.csv", "x,y\n0,0\n1,1\n2,3\n");
  folder.write("m.json", "old");
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv -t z -o m.json").exit_code, 1);
  EXPECT_EQ(llmt::read_file(folder.file("m.json")), "old");
  EXPECT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json").exit_code, 0);
  EXPECT_EQ(folder.run(llmt_program + " predict m.json d.csv >/dev/full").exit_code, 1);
}

TEST(LlmtProgram, SameBytesWhateverTheThreads) {
  const Folder folder;
  folder.write("d.csv", table());
  for (const char* threads : {"1", "2", "8"}) {
    ASSERT_EQ(folder
                  .run(fmt::format("{} fit d.csv -t y,z --ignore label --threads {} -o m{}.json", llmt_program, threads,
                                   threads))
                  .exit_code,
              0);
  }
  EXPECT_EQ(llmt::read_file(folder.file("m1.json")), llmt::read_file(folder.file("m2.json")));
  EXPECT_EQ(llmt::read_file(folder.file("m1.json")), llmt::read_file(folder.file("m8.json")));
}

}  // namespace
