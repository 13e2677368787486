// Mechanisms from the command line.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"
#include "llmt/files.hpp"

namespace {

using program::Folder;
using program::Outcome;
using program::robot_program;

const std::string five_bar = std::string(LLMT_ROOT) + "/docs/samples/five_bar.yaml";

Outcome mechanism(const Folder& folder, const std::string& arguments) {
  return folder.run(fmt::format("{} mechanism {}", robot_program, arguments));
}

// A five-bar with one crank 0.7 mm short, and readings of it.
void measure(const Folder& folder, const std::string& coordinates) {
  std::string text = llmt::read_file(five_bar);
  const std::string nominal = "crank1, value_mm: 200";
  text.replace(text.find(nominal), nominal.size(), "crank1, value_mm: 199.3");
  folder.write("real.yaml", text);
  const Outcome run =
      mechanism(folder, "real.yaml --simulate 40 --noise x=0.01,y=0.01 -o seen.csv --measure " + coordinates);
  ASSERT_EQ(run.exit_code, 0) << run.err;
}

TEST(MechanismProgram, FindsAShortCrankAndWritesIt) {
  const Folder folder;
  measure(folder, "q1,q2,x,y");
  const Outcome run = mechanism(folder, five_bar + " seen.csv --json -o found.yaml --errors errors.csv");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json found = nlohmann::json::parse(run.out);
  EXPECT_EQ(found["parameters"][1]["name"], "crank1");
  EXPECT_NEAR(found["parameters"][1]["identified"].get<double>(), 199.3, 0.04);
  EXPECT_LT(found["errors"][0]["held_out_rms"].get<double>(), 0.02);
  EXPECT_GT(found["errors"][0]["described_rms"].get<double>(), 0.1);
  EXPECT_EQ(found["not_shown"], (std::vector<std::string>{"offset_p1", "offset_p2"}));
  EXPECT_NE(llmt::read_file(folder.file("found.yaml")).find("standard_error_mm"), std::string::npos);
  EXPECT_TRUE(
      llmt::read_file(folder.file("errors.csv")).starts_with("q1_deg,q2_deg,x_mm,y_mm,x_error_mm,y_error_mm\n"));
  const Outcome text = mechanism(folder, "found.yaml seen.csv");
  EXPECT_NE(text.out.find("NO GAIN"), std::string::npos) << text.out;
}

TEST(MechanismProgram, SolvesForWhatTheTableDoesNotHave) {
  const Folder folder;
  folder.write("poses.csv", "q1_deg,q2_deg\n120,60\n179,1\n");
  const Outcome run = mechanism(folder, five_bar + " poses.csv --solve --measure x,y");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_TRUE(run.out.starts_with("x_mm,y_mm\n150.0") || run.out.starts_with("x_mm,y_mm\n149.9")) << run.out;
  EXPECT_NE(run.err.find("poses.csv:3: "), std::string::npos) << run.err;
}

TEST(MechanismProgram, TooFewPosesAreSaidFirstAndNothingIsWritten) {
  const Folder folder;
  measure(folder, "q1,q2,x,y");
  folder.run("head -4 seen.csv > few.csv");
  const Outcome run = mechanism(folder, five_bar + " few.csv -o found.yaml");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.out.find("TOO FEW READINGS"), std::string::npos) << run.out;
  EXPECT_FALSE(std::filesystem::exists(folder.file("found.yaml")));
}

// The readings with a number added to the cell of one line and column.
std::string with_reading(const Folder& folder, int line, const std::string& column, double more) {
  const llmt::Csv csv = llmt::Csv::read(folder.file("seen.csv"));
  Eigen::MatrixXd values = csv.numbers(csv.columns());
  values(line - 2, static_cast<Eigen::Index>(csv.index_of(column))) += more;
  std::string text(csv.header_text());
  for (const auto row : values.rowwise())
    text += fmt::format("\n{}", fmt::join(std::vector<double>(row.begin(), row.end()), ","));
  return text + "\n";
}

TEST(MechanismProgram, OneBadReadingIsNamedAndLeftOutOnRequest) {
  const Folder folder;
  measure(folder, "q1,q2,x,y");
  // mm; the second one no mechanism can take. The first line of the readings, and the last.
  for (const auto& [wrong, line] : {std::pair{300.0, 2}, std::pair{1e6, 41}}) {
    folder.write("bad.csv", with_reading(folder, line, "x_mm", wrong));
    const Outcome plain = mechanism(folder, five_bar + " bad.csv --folds 0");
    EXPECT_NE(
        plain.out.find("CONTRADICTED: 1 of 40 poses contradicts the others, and the parameters are made to fit it"),
        std::string::npos)
        << plain.out;
    EXPECT_NE(plain.err.find(fmt::format("bad.csv:{}: contradicts the other poses; --robust", line)), std::string::npos)
        << plain.err;
    EXPECT_EQ(plain.out.find("CALIBRATED"), std::string::npos) << plain.out;
    const Outcome robust = mechanism(folder, five_bar + " bad.csv --robust --json");
    ASSERT_EQ(robust.exit_code, 0) << robust.err;
    EXPECT_NE(robust.err.find(fmt::format("bad.csv:{}: contradicts the other poses: left out", line)),
              std::string::npos);
    const nlohmann::json found = nlohmann::json::parse(robust.out);
    EXPECT_NEAR(found["parameters"][1]["identified"].get<double>(), 199.3, 0.04);
    EXPECT_EQ(found["contradicting_lines"], std::vector<int>{line});
  }
  const Outcome clean = mechanism(folder, five_bar + " seen.csv --robust");
  EXPECT_NE(clean.out.find("40 poses of five-bar; measured"), std::string::npos) << clean.out;
  EXPECT_EQ(clean.err.find("contradicts"), std::string::npos) << clean.err;
}

TEST(MechanismProgram, TheFileAtFaultIsNamed) {
  const Folder folder;
  measure(folder, "q1,q2,x,y");
  std::string text = llmt::read_file(five_bar);
  const std::string start = "base, value_mm: 300";
  text.replace(text.find(start), start.size(), "base, value_mm: 3000");
  folder.write("wide.yaml", text);
  for (const char* arguments : {"wide.yaml --simulate 5", "wide.yaml seen.csv", "wide.yaml seen.csv --solve"}) {
    const Outcome run = mechanism(folder, arguments);
    EXPECT_EQ(run.exit_code, 1) << arguments;
    EXPECT_NE(run.err.find("wide.yaml: no configuration near the start values"), std::string::npos) << run.err;
  }
  EXPECT_EQ(mechanism(folder, five_bar + " seen.csv --folds 1").err,
            "llmt-robot: --folds is \"1\", it must be 0, or a whole number, 2 or more\n");
  EXPECT_EQ(mechanism(folder, "/dev/zero seen.csv").err,
            "llmt-robot: /dev/zero: cannot be read: it holds more than 16 MiB, the most that is read\n");
}

TEST(MechanismProgram, MistakesAreRefusedWithTheirPlace) {
  const Folder folder;
  const auto says = [&](const std::string& text, const std::string& words) {
    folder.write("t.csv", text);
    const Outcome run = mechanism(folder, five_bar + " t.csv");
    EXPECT_EQ(run.exit_code, 1) << words;
    EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
  };
  says("", "empty");
  says("q1_deg\n", "there is no pose");
  says("a,b\n1,2\n", "no column is a coordinate");
  says("q1,q2_deg\n1,2\n", "column \"q1\" has no unit, name it q1_deg or q1_rad");
  says("q1_mm,q2_deg\n1,2\n", "column \"q1_mm\" has a wrong unit");
  says("q1_deg,q1_rad\n1,2\n", "are one coordinate");
  says("q1_deg,q2_deg\n1,x\n", "t.csv:2: column \"q2_deg\"");
  says("q1_deg,q2_deg\n1,2\n1,nan\n", "t.csv:3: column \"q2_deg\": 'nan' is not finite");
  says("q1_deg,q2_deg\n120,60\n", "no reading checks another one");
  says("q1_rad,q2_deg\n120,60\n",
       "t.csv: column of q1: 1 of 1 readings are far outside its limits, 80 to 150 deg: they "
       "look like degrees that are called radians");
  says("q1_deg,q2_deg\n2.1,60\n", "they look like radians");
  says("Q1_deg,q2_deg\n120,60\n", "no coordinates of five-bar: Q1_deg; not measured: q1, p1, p2, x, y");
  folder.write("t.csv", "q1_deg,q2_deg\n120,60\n");
  EXPECT_EQ(mechanism(folder, "t.csv " + five_bar).exit_code, 2);
  EXPECT_EQ(mechanism(folder, five_bar).exit_code, 2);
  EXPECT_EQ(mechanism(folder, five_bar + " --simulate 5 --noise z=1").exit_code, 2);
}

}  // namespace
