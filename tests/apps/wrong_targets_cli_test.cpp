// Wrong targets: llmt fit says which few rows no tree follows, and of nothing in honest data.
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/programs.hpp"
#include "llmt/random.hpp"
#include "study.hpp"

namespace {

using program::Folder;
using program::llmt_program;
using program::Outcome;

using Noise = std::function<double(llmt::Random&)>;

double normal(llmt::Random& random) { return 0.25 * random.normal(); }

double student(llmt::Random& random) {
  double squares = 0.0;
  for (int k = 0; k < 4; ++k) squares += std::pow(random.normal(), 2);
  return normal(random) / std::sqrt(squares / 4.0);
}

double lognormal(llmt::Random& random) { return 0.25 * std::exp(random.normal()); }

// Bent and with a jump, targets over some 20 units. `wrong`: what is added to the targets of lines of the file.
std::string table(int rows, std::uint64_t seed, const Noise& noise, const std::map<int, double>& wrong = {}) {
  llmt::Random random(seed);
  std::string text = "a,b,c,y\n";
  for (int row = 0; row < rows; ++row) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(-1.0, 1.0);
    const double c = random.uniform(-1.0, 1.0);
    const double jump = b > 0.3 ? 5.0 : 0.0;
    const double y = 3.0 * std::sin(3.0 * a) + 4.0 * std::abs(b) + 2.0 * a * c + jump + noise(random);
    const auto added = wrong.find(row + 2);
    text += fmt::format("{},{},{},{:.6g}\n", a, b, c, y + (added != wrong.end() ? added->second : 0.0));
  }
  return text;
}

std::string warning_of(const Folder& folder, const std::string& text, const std::string& options = "") {
  folder.write("d.csv", text);
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y " + options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return outcome.err;
}

TEST(WrongTargets, ThreeOfTwoThousandAreNamedByTheirLines) {
  const Folder folder;
  const std::string text = table(2000, 1, normal, {{102, 60.0}, {702, -50.0}, {1502, 90.0}});
  const std::string warning = warning_of(folder, text);
  EXPECT_TRUE(warning.starts_with("llmt: 3 of 2000 held-out rows carry 9")) << warning;
  EXPECT_NE(warning.find(" % of the held-out squared error of \"y\": lines 1502 ("), std::string::npos) << warning;
  EXPECT_NE(warning.find("), 102 ("), std::string::npos) << warning;
  EXPECT_NE(warning.find("), 702 ("), std::string::npos) << warning;
  EXPECT_NE(warning.find("use --loss tukey, which leaves such rows out"), std::string::npos) << warning;
  EXPECT_EQ(warning_of(folder, text, "--json"), warning);
  EXPECT_EQ(warning_of(folder, text, "--no-intervals -o m.json"), warning);
  // With that loss there is nothing to warn of, and the summary has the lines too.
  const Outcome robust = folder.run(llmt_program + " fit d.csv -t y --loss tukey");
  EXPECT_EQ(robust.err, "");
  EXPECT_NE(robust.out.find("Rows left out by the Tukey loss: 3 of 2000 (lines 102, 702, 1502); the errors below are "
                            "those of the other rows\n"),
            std::string::npos)
      << robust.out;
}

// Three wrong targets make an error of 7 whatever the method: sqrt((60^2 + 50^2 + 90^2) / 300). With the loss they do
// not count, and least squares, which has few coefficients, is as on the clean table.
TEST(WrongTargets, CompareTakesTheLoss) {
  const Folder folder;
  const std::map<int, double> wrong = {{52, 60.0}, {152, -50.0}, {252, 90.0}};
  const auto compared = [&](const std::map<int, double>& added, const std::string& options) {
    folder.write("d.csv", table(300, 4, normal, added));
    const Outcome outcome = folder.run(llmt_program + " compare d.csv -t y --cv 2 --json " + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const nlohmann::json clean = compared({}, "");
  const nlohmann::json robust = compared(wrong, "--loss tukey");
  EXPECT_EQ(robust["lines_left_out"], (std::vector<int>{52, 152, 252}));
  EXPECT_EQ(robust["rows_left_out"], (std::vector<int>{51, 151, 251}));
  EXPECT_FALSE(clean.contains("rows_left_out"));
  const double least_squares = clean["methods"][0]["cv_rmse"];
  EXPECT_NEAR(robust["methods"][0]["cv_rmse"], least_squares, 0.02 * least_squares);
  for (const nlohmann::json& method : robust["methods"]) {
    EXPECT_LT(method["cv_rmse"], 1.02 * least_squares) << method["method"];
  }
  const Outcome text = folder.run(llmt_program + " compare d.csv -t y --cv 2 --loss tukey");
  EXPECT_EQ(text.err, "");
  EXPECT_NE(text.out.find("Rows left out by the Tukey loss: 3 of 300 (lines 52, 152, 252); the errors below"),
            std::string::npos)
      << text.out;
}

TEST(WrongTargets, LinesAreThoseOfTheFile) {
  const Folder folder;
  std::string text = table(500, 2, normal, {{52, 40.0}});
  text.insert(text.find('\n') + 1, "\n\n");  // blank lines are no rows
  const std::string warning = warning_of(folder, text);
  EXPECT_TRUE(warning.starts_with("llmt: 1 of 500 held-out rows carries ")) << warning;
  EXPECT_NE(warning.find("line 54 ("), std::string::npos) << warning;
}

TEST(WrongTargets, RowsOfWeightZeroAreNotCountedAsLeftOut) {
  const Folder folder;
  llmt::Random random(5);
  std::string text = "x,w,y\n";
  for (int row = 0; row < 300; ++row) {
    const double x = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", x, row % 3, 2.0 * x + normal(random) + (row % 150 == 100 ? 50.0 : 0.0));
  }
  folder.write("d.csv", text);
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y --weight w --loss tukey");
  EXPECT_NE(outcome.out.find("Rows left out by the Tukey loss: 2 of 200 (lines 102, 252); the errors"),
            std::string::npos)
      << outcome.out;
}

TEST(WrongTargets, HonestTailsAreNotAccused) {
  const Folder folder;
  const std::map<std::string, Noise> noises = {{"normal", normal}, {"student", student}, {"lognormal", lognormal}};
  for (const auto& [name, noise] : noises) {
    for (std::uint64_t seed = 1; seed <= sampled(3u, 1u); ++seed) {
      EXPECT_EQ(warning_of(folder, table(600, seed, noise)), "") << name << " " << seed;
    }
  }
}

TEST(WrongTargets, AReadableTreeThatIsNotNearEnoughSaysHowFarItIs) {
  const Folder folder;
  int far = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    folder.write("d.csv", table(150, seed, normal, {{52, 40.0}}));
    const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --readable=1 --cv 3");
    ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
    const bool is_far = fitted.out.find("\nNo short tree came within 1 % of ") != std::string::npos;
    const bool is_near =
        fitted.out.find("\nWhen it was chosen the readable tree was the smallest one at most 1 % above ") !=
        std::string::npos;
    EXPECT_NE(is_far, is_near) << fitted.out;
    EXPECT_EQ(is_far, fitted.out.find("; this one came nearest.\n") != std::string::npos) << fitted.out;
    far += is_far ? 1 : 0;
  }
  EXPECT_GT(far, 0);
  EXPECT_LT(far, 6);
}

// Where there is no noise, the rows beside jumps and bends carry all of the error; the model follows them.
TEST(WrongTargets, RowsBesideAJumpAreNotAccused) {
  const Folder folder;
  const Noise none = [](llmt::Random&) { return 0.0; };
  for (const std::uint64_t seed : {1, 2, 3}) EXPECT_EQ(warning_of(folder, table(600, seed, none)), "") << seed;
}

TEST(WrongTargets, APictureDoesNotShowRowsThatWereLeftOut) {
  const Folder folder;
  if (folder.run("gnuplot --version").exit_code != 0) GTEST_SKIP() << "there is no gnuplot";
  folder.write("d.csv", table(300, 3, normal, {{52, 1e6}}));
  const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y --loss tukey --plot p.svg");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string picture = llmt::read_file(folder.file("p.svg"));
  EXPECT_NE(picture.find("rows, without 1 left out"), std::string::npos);
  EXPECT_EQ(picture.find("1x10"), std::string::npos);
  EXPECT_EQ(picture.find("1e+06"), std::string::npos);
  EXPECT_EQ(picture.find("00000<"), std::string::npos);
}

}  // namespace
