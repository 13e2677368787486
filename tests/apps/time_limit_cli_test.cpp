#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/files.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

constexpr const char* no_time = " --time-limit 1e-9";  // the smallest fit takes longer

void write_waves(const Folder& folder) {
  llmt::Random random(1);
  std::string text = "a,b,y\n";
  for (int i = 0; i < 150; ++i) {
    const double a = random.uniform(0.0, 1.0);
    const double b = random.uniform(0.0, 1.0);
    text += fmt::format("{},{},{}\n", a, b, std::sin(9.0 * a) * b + 0.01 * random.normal());
  }
  folder.write("d.csv", text);
}

Outcome fit_waves(const Folder& folder, const std::string& options) {
  return folder.run(LLMT_PROGRAM " fit d.csv -t y " + options);
}

TEST(TimeLimit, NamesTheOptionThatMakesTheSameFile) {
  const Folder folder;
  write_waves(folder);
  for (const auto& [form, again] : {std::pair{"", "--max-leaves 8"}, std::pair{"--boost", "--max-rounds 32"}}) {
    const Outcome timed = fit_waves(folder, fmt::format("{} {} -o timed.json", form, no_time));
    ASSERT_EQ(timed.exit_code, 0) << timed.err;
    EXPECT_NE(timed.out.find("Time limit of 1e-09 s: too short, the fit with"), std::string::npos) << timed.out;
    EXPECT_NE(timed.out.find(fmt::format("the same model again: {}", again)), std::string::npos) << timed.out;
    ASSERT_EQ(fit_waves(folder, fmt::format("{} {} -o again.json", form, again)).exit_code, 0);
    EXPECT_EQ(llmt::read_file(folder.file("timed.json")), llmt::read_file(folder.file("again.json")));
    EXPECT_EQ(json::parse(llmt::read_file(folder.file("timed.json")))["training"]["size_limit"],
              again[0] == '-' && *form ? 32 : 8);
    const Outcome inspected = folder.run(LLMT_PROGRAM " inspect timed.json");
    EXPECT_NE(inspected.out.find(fmt::format("as {} does", again)), std::string::npos) << inspected.out;
    const json facts = json::parse(folder.run(LLMT_PROGRAM " inspect timed.json --json").out);
    EXPECT_EQ(facts.contains("max_rounds") ? facts["max_rounds"] : facts["max_leaves"], *form ? 32 : 8);
    ASSERT_EQ(fit_waves(folder, fmt::format("{} -o whole.json", form)).exit_code, 0);
    EXPECT_EQ(folder.run(LLMT_PROGRAM " inspect whole.json").out.find("Fitted with at most"), std::string::npos);
    EXPECT_NE(llmt::read_file(folder.file("timed.json")), llmt::read_file(folder.file("whole.json")));
  }
}

TEST(TimeLimit, ThatIsEnoughChangesNothing) {
  const Folder folder;
  write_waves(folder);
  for (const char* form : {"", "--boost"}) {
    const Outcome timed = fit_waves(folder, fmt::format("{} --time-limit 1e6 -o timed.json", form));
    ASSERT_EQ(timed.exit_code, 0) << timed.err;
    EXPECT_NE(timed.out.find("not reached, the model is that of a fit without a limit"), std::string::npos)
        << timed.out;
    ASSERT_EQ(fit_waves(folder, fmt::format("{} -o whole.json", form)).exit_code, 0);
    EXPECT_EQ(llmt::read_file(folder.file("timed.json")), llmt::read_file(folder.file("whole.json")));
  }
}

// The smallest fit is all that there is to do, and it is late.
TEST(TimeLimit, ThatIsPassedByTheWholeFitIsSaidToBeTooShort) {
  const Folder folder;
  write_waves(folder);
  const Outcome timed = fit_waves(folder, fmt::format("--max-leaves 5 {}", no_time));
  EXPECT_NE(timed.out.find("too short, the fit took"), std::string::npos) << timed.out;
  EXPECT_EQ(timed.out.find("not reached"), std::string::npos) << timed.out;
}

TEST(TimeLimit, IsInTheSummary) {
  const Folder folder;
  write_waves(folder);
  const json tree = json::parse(fit_waves(folder, fmt::format("--json {}", no_time)).out)["time_limit"];
  EXPECT_EQ(tree["max_leaves"], 8);
  EXPECT_EQ(tree["reached"], true);
  EXPECT_GT(tree["taken"], 0.0);
  const json sum = json::parse(fit_waves(folder, "--json --boost --time-limit 1e6").out)["time_limit"];
  EXPECT_EQ(sum["max_rounds"], 2000);
  EXPECT_EQ(sum["reached"], false);
  EXPECT_EQ(sum["seconds"], 1e6);
}

TEST(TimeLimit, IsRefusedByNameWhereItIsNone) {
  const Folder folder;
  write_waves(folder);
  for (const auto& [options, words] :
       {std::pair{"--time-limit 0", "--time-limit is \"0\", it must be a finite number above 0"},
        std::pair{"--time-limit soon", "--time-limit is \"soon\""},
        std::pair{"--time-limit 5 --teach", "--time-limit does not go with --teach"},
        std::pair{"--time-limit 5 --stream", "--time-limit"},
        std::pair{"--time-limit 5 --lags y:1", "--time-limit is not for systems that move"},
        std::pair{"--max-rounds 5", "--max-rounds is for --boost"},
        std::pair{"--max-rounds 0 --boost", "--max-rounds is \"0\""}}) {
    const Outcome outcome = fit_waves(folder, options);
    EXPECT_NE(outcome.exit_code, 0) << options;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << options << ": " << outcome.err;
  }
}

}  // namespace
