// What the program llmt says of tables and arguments that are not as they should be.
#include <fmt/format.h>

#include <cmath>
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
  EXPECT_NE(refused_text(folder, "predict d.csv d.csv", 1).find("not JSON"), std::string::npos);
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
            "4, 6: fill them in or "
            "leave them out\n");
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
