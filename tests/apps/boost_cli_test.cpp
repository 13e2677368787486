#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/boosted.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

// y has a kink in `a` and depends on `colour`; a row in ten has no `a`.
std::string kinked_with_colours(int rows) {
  llmt::Random random(1);
  std::string text = "a,colour,y\n";
  for (int i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const bool red = random.uniform() < 0.5;
    text += fmt::format("{},{},{}\n", i % 10 == 3 ? "" : fmt::format("{}", a), red ? "red" : "blue",
                        2.0 * std::abs(a) + (red ? 1.0 : 0.0) + 0.05 * random.normal());
  }
  return text;
}

TEST(BoostProgram, FitsAndPredictsAsTheLibrary) {
  const Folder folder;
  folder.write("d.csv", kinked_with_colours(300));
  const Outcome fitted = folder.run(LLMT_PROGRAM " fit d.csv -t y --boost -o m.json --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json summary = json::parse(fitted.out);
  EXPECT_EQ(summary["sums"][0]["rows"], 300);
  EXPECT_LT(summary["sums"][0]["held_out_rmse"], 0.3);
  const llmt::BoostedModel model = llmt::load_boosted(folder.file("m.json"));
  EXPECT_EQ(model.inputs()[1].levels, (std::vector<std::string>{"blue", "red"}));

  folder.write("new.csv", "colour,a\nred,0.5\nblue,9\ngreen,\n");
  const Outcome predicted = folder.run(LLMT_PROGRAM " predict m.json new.csv");
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  const llmt::Csv answer = llmt::Csv::parse(predicted.out, "answer");
  EXPECT_EQ(answer.columns(), (std::vector<std::string>{"colour", "a", "y_pred", "outside", "outside_by"}));
  Eigen::MatrixXd inputs(3, 2);
  const double no_value = std::nan("");
  inputs << 0.5, 1.0, 9.0, 0.0, no_value, no_value;
  EXPECT_EQ(answer.numbers("y_pred"), model.predict(inputs).col(0));
  EXPECT_EQ(answer.numbers("outside"), (Eigen::Vector3d{0.0, 1.0, 0.0}));
}

TEST(BoostProgram, RefusesByNameWhatIsForOneTree) {
  const Folder folder;
  folder.write("d.csv", kinked_with_colours(60));
  ASSERT_EQ(folder.run(LLMT_PROGRAM " fit d.csv -t y --boost -o m.json").exit_code, 0);
  const auto refused = [&](const std::string& command, const std::string& words) {
    const Outcome outcome = folder.run(LLMT_PROGRAM " " + command);
    EXPECT_NE(outcome.exit_code, 0) << command;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  };
  refused("fit d.csv -t y --boost --monotone a", "--monotone is not for --boost");
  refused("fit d.csv -t y --boost --readable", "--readable is not for --boost");
  refused("fit d.csv -t y --boost --stream", "--boost is not for --stream");
  refused("predict m.json d.csv --interval 0.9", "--interval is not for a boosted model");
  for (const char* command : {"inspect m.json", "explain m.json d.csv", "export --c m.json -o m.c"}) {
    refused(command, "m.json: a boosted model, the sum of many trees; one tree is needed here");
  }
}

}  // namespace
