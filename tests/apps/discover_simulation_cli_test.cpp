// llmt discover with parameters of the simulation, a command as the simulation, and what was found applied.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

const std::string discover = LLMT_PROGRAM " discover ";

// A cart: tau = mass ddq + damping dq, nominal 3 and 1. The real one has 3.5, 1.4 and drag dq |dq|. Writes s.csv,
// m.csv, and by.csv with derivatives by mass, damping and an armature that acts as the mass does.
void write_cart(const Folder& folder, double drag, std::uint64_t seed = 1, bool parameters_are_off = true) {
  llmt::Random random(seed);
  std::string simulated = "q,dq,ddq,tau\n";
  std::string measured = simulated;
  std::string by = "q,mass,tau:damping,armature\n";
  for (int i = 0; i < 400; ++i) {
    const double q = random.uniform(-1.0, 1.0);
    const double dq = random.uniform(-1.5, 1.5);
    const double ddq = random.uniform(-4.0, 4.0);
    const double nominal = 3.0 * ddq + dq;
    const double real = (parameters_are_off ? 3.5 * ddq + 1.4 * dq : nominal) + drag * dq * std::abs(dq);
    simulated += fmt::format("{},{},{},{}\n", q, dq, ddq, nominal);
    measured += fmt::format("{},{},{},{}\n", q, dq, ddq, real + 0.1 * random.normal());
    by += fmt::format("{},{},{},{}\n", q, ddq, dq, ddq);
  }
  folder.write("s.csv", simulated);
  folder.write("m.csv", measured);
  folder.write("by.csv", by);
}

// The cart as a command that reads columns by their names.
void write_command(const Folder& folder) {
  folder.write("cart.awk",
               "BEGIN { FS = \",\" }\n"
               "NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; print \"tau\"; next }\n"
               "{ printf \"%.10g\\n\", sqrt($at[\"m2\"]) * $at[\"ddq\"] + $at[\"damping\"] * $at[\"dq\"] }\n");
}

void expect_change(const json& parameter, const std::string& name, double change) {
  EXPECT_EQ(parameter["name"], name);
  EXPECT_NEAR(parameter["change"].get<double>(), change, 4.0 * parameter["std_error"].get<double>());
}

TEST(DiscoverParameters, AreFittedBesideTermsAndNamedTogetherWhereRowsCannotTell) {
  const Folder folder;
  write_cart(folder, 1.5);
  const std::string command =
      discover + "s.csv m.csv -t tau --parameters by.csv --parameter 'mass=3[kg]' --parameter armature=0.1 ";
  const Outcome outcome = folder.run(command + "--json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json report = json::parse(outcome.out);
  EXPECT_EQ(report["verdict"], "named");
  ASSERT_EQ(report["effects"].size(), 1U);
  EXPECT_EQ(report["effects"][0]["name"], "signed_square");
  ASSERT_EQ(report["parameters"].size(), 2U);
  expect_change(report["parameters"][0], "mass + armature", 0.5);
  EXPECT_NEAR(report["parameters"][0]["nominal"].get<double>(), 3.1, 1e-9);
  EXPECT_EQ(report["parameters"][0]["unit"], "kg");
  expect_change(report["parameters"][1], "damping", 0.4);
  EXPECT_EQ(report["parameters"][1]["nominal"], nullptr);  // nobody said it
  EXPECT_GT(report["gap"]["nominal"], report["gap"]["before"]);
  EXPECT_GT(report["gap"]["before"], report["gap"]["after"]);
  const Outcome page = folder.run(command);
  EXPECT_NE(page.out.find("VERDICT: one term is missing: signed_square of "), std::string::npos) << page.out;
  EXPECT_NE(page.out.find("Parameters of the simulation, fitted together with the terms:"), std::string::npos);
  EXPECT_NE(page.out.find("parameters alone"), std::string::npos);
}

TEST(DiscoverParameters, AloneAreTheVerdict) {
  const Folder folder;
  write_cart(folder, 0.0);
  const std::string command = discover + "s.csv m.csv -t tau --parameters by.csv ";
  const json report = json::parse(folder.run(command + "--json").out);
  EXPECT_EQ(report["verdict"], "parameters only");
  EXPECT_TRUE(report["effects"].empty());
  const Outcome page = folder.run(command);
  EXPECT_NE(
      page.out.find("VERDICT: nothing is missing, but mass + armature and damping are off their nominal values\n"),
      std::string::npos)
      << page.out;
  write_cart(folder, 0.0, 1, false);
  EXPECT_EQ(json::parse(folder.run(command + "--json").out)["verdict"], "nothing missing");
}

TEST(DiscoverParameters, MistakesAreNamed) {
  const Folder folder;
  write_cart(folder, 0.0);
  folder.write("short.csv", "mass\n1\n2\n");
  folder.write("none.csv", folder.run("cut -d, -f1 by.csv").out);
  folder.write("other.csv", folder.run("awk -F, -v OFS=, 'NR == 5 { $1 = 7 } { print }' by.csv").out);
  folder.write("word.csv", folder.run("awk -F, -v OFS=, 'NR == 5 { $2 = \"x\" } { print }' by.csv").out);
  folder.write("wrong.csv", folder.run("sed '1s/tau:damping/torque:damping/' by.csv").out);
  struct Case {
    std::string arguments;
    int exit_code;
    std::string message;
  };
  const std::vector<Case> cases = {
      {"--parameters no.csv", 1, "no.csv: cannot be read"},
      {"--parameters short.csv", 1, "short.csv has 2 rows, the inputs have 400"},
      {"--parameters none.csv", 1, "none.csv: no columns of derivatives beside the inputs"},
      {"--parameters other.csv", 1, "other.csv:5: column \"q\" is 7, but the input of that name is"},
      {"--parameters word.csv", 1, "word.csv:5: column \"mass\""},
      {"--parameters wrong.csv", 1, "wrong.csv: column \"torque:damping\" is neither an input nor a derivative"},
      {"--parameters by.csv --parameter weight=3", 2, "by.csv has no derivatives by \"weight\"; there are mass"},
      {"--parameters by.csv --parameter mass", 2, "\"mass\" has no name and =, must be of the form mass=3.0[kg]"},
      {"--parameters by.csv --parameter mass=heavy", 2, "has the value \"heavy\", which is no finite number"},
      {"--parameters by.csv --parameter 'mass=3[kg'", 2, "has a [ that no ] closes"},
      {"--parameters by.csv --parameter mass=3 --parameter mass=4", 2, "\"mass\" is given twice"},
      {"--parameter mass=3", 2, "--parameter needs --parameters FILE or --simulate COMMAND"},
  };
  for (const Case& entry : cases) {
    const Outcome outcome = folder.run(discover + "s.csv m.csv -t tau " + entry.arguments);
    EXPECT_EQ(outcome.exit_code, entry.exit_code) << entry.arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(entry.message), std::string::npos) << entry.arguments << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "") << entry.arguments;
  }
}

// m2, the square of the mass, is not linear: the command runs again at the estimates.
TEST(DiscoverSimulate, ACommandIsFittedTogetherWithTerms) {
  const Folder folder;
  write_command(folder);
  for (const double drag : {0.0, 1.5}) {
    write_cart(folder, drag);
    const Outcome outcome = folder.run(
        discover + "m.csv -t tau --simulate 'awk -f cart.awk' --parameter 'm2=9[kg^2]' --parameter damping=1 --json");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const json report = json::parse(outcome.out);
    EXPECT_EQ(report["verdict"], drag > 0.0 ? "named" : "parameters only");
    ASSERT_EQ(report["parameters"].size(), 2U);
    expect_change(report["parameters"][0], "m2", 3.5 * 3.5 - 9.0);
    expect_change(report["parameters"][1], "damping", 0.4);
    EXPECT_LT(report["gap"]["after"].get<double>(), 0.13);
    EXPECT_GT(report["gap"]["nominal"].get<double>(), 1.0);
  }
}

TEST(DiscoverSimulate, ARandomCommandIsRefused) {
  const Folder folder;
  write_cart(folder, 0.0);
  folder.write("noisy.awk",
               "BEGIN { FS = \",\"; srand(seed) }\n"
               "NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; print \"tau\"; next }\n"
               "{ printf \"%.10g\\n\", $at[\"mass\"] * $at[\"ddq\"] + 1e-4 * rand() }\n");
  const std::string command = "awk -v seed=$(($(od -An -N3 -tu4 /dev/urandom))) -f noisy.awk";
  const Outcome outcome = folder.run(discover + "m.csv -t tau --simulate '" + command + "' --parameter mass=3");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("--simulate \"" + command + "\": the simulation "), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("was run twice at the same values, and \"tau\" is "), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find(" in data row 1; it must not be random"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("m.csv"), std::string::npos) << outcome.err;
}

TEST(DiscoverSimulate, WhatACommandDoesWrongIsSaid) {
  const Folder folder;
  write_command(folder);
  write_cart(folder, 0.0);
  struct Case {
    std::string command;
    std::string message;
  };
  const std::vector<Case> cases = {
      {"echo \"no model\" >&2; exit 3", "at m2 = 9.000, damping = 1.000: it ended with exit code 3; it said: no model"},
      {"no_such_program", "it ended with exit code 127"},
      {"kill -9 $$", "it was ended by signal 9"},
      {"sleep 60", "it did not end within 0.5 s"},
      {"sleep 60 & exec awk -f cart.awk | head -100", "it wrote 99 rows for 400"},
      {"true", "it wrote nothing"},
      {"awk -f cart.awk | sed s/tau/torque/", "torque"},
      {"awk -f cart.awk | sed 7s/.*/nan/", "its output:7: column \"tau\""},
      {"yes", "it did not end within"},
  };
  for (const Case& entry : cases) {
    // Long enough for a busy machine where the command ends by itself.
    const bool is_endless = entry.message.starts_with("it did not end");
    const Outcome outcome = folder.run(
        fmt::format("{} m.csv -t tau --simulate-seconds {} --simulate '{}' --parameter m2=9 --parameter damping=1",
                    discover, is_endless ? 0.5 : 30.0, entry.command));
    EXPECT_EQ(outcome.exit_code, 1) << entry.command << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(entry.message), std::string::npos) << entry.command << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "") << entry.command;
  }
}

// A command that writes while it reads, more than a pipe holds, does not stop either side.
TEST(DiscoverSimulate, LongTablesPass) {
  const Folder folder;
  std::string measured = "x,y\n";
  for (int i = 0; i < 4000; ++i) {
    measured += fmt::format("{:.15f},{}\n", 0.005 * i, 0.01 * i + 0.01 * ((i * 7919) % 13));  // 18 bytes of x a row
  }
  folder.write("m.csv", measured);
  folder.write("line.awk",
               "BEGIN { FS = \",\" } NR == 1 { print \"padding,y\"; next } { printf \"%060d,%.9g\\n\", 0, $2 * $1 }");
  const Outcome outcome = folder.run(discover + "m.csv -t y --simulate 'awk -f line.awk' --parameter slope=1 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NEAR(json::parse(outcome.out)["parameters"][0]["value"].get<double>(), 2.0, 0.05);
}

TEST(DiscoverApply, CorrectsOtherRowsAsTheSearchDidItsOwn) {
  const Folder folder;
  // A step, a settling and a term of the row before.
  llmt::Random random(4);
  std::string simulated = "t,a,b,y\n";
  std::string measured = simulated;
  double last = 0.0;
  double direction = 0.0;
  for (int i = 0; i < 300; ++i) {
    const double t = 0.5 * i;
    const double a = random.uniform(-2.0, 5.0);
    direction = i == 0 ? 0.0 : a > last ? 1.0 : -1.0;
    last = a;
    const double b = random.uniform();
    const double y = 3.0 + 2.0 * a - 4.0 * b;
    const double hidden = (a > 3.2 ? 0.6 : 0.0) + 0.8 * std::exp(-t / 12.0) + 0.3 * direction;
    simulated += fmt::format("{},{},{},{}\n", t, a, b, y);
    measured += fmt::format("{},{},{},{}\n", t, a, b, 0.1 + 1.01 * y + hidden + 0.05 * random.normal());
  }
  folder.write("s.csv", simulated);
  folder.write("m.csv", measured);
  const Outcome search =
      folder.run(discover + "s.csv m.csv -t y --order t --allow offset,scale -o c.csv --json > found.json");
  ASSERT_EQ(search.exit_code, 0) << search.err;
  const Outcome applied = folder.run(discover + "--apply found.json s.csv m.csv -o again.csv");
  ASSERT_EQ(applied.exit_code, 0) << applied.err;
  EXPECT_NE(applied.out.find("Gap, root mean square:"), std::string::npos) << applied.out;
  const Eigen::VectorXd once = llmt::Csv::read(folder.file("c.csv")).numbers("y_corrected");
  const llmt::Csv again = llmt::Csv::read(folder.file("again.csv"));
  EXPECT_LT((again.numbers("y_corrected") - once).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_TRUE(again.has("y_measured"));
  // The tables that -o writes can be read again.
  const json gaps = json::parse(folder.run(discover + "--apply found.json c.csv --json").out);
  EXPECT_LT(gaps["gap"][0]["after"].get<double>(), 0.08);
  EXPECT_GT(gaps["gap"][0]["before"].get<double>(), 0.3);
  // Rows that lie elsewhere, and measured values that it does not hold for.
  folder.write("far.csv", "t,a,b,y,y_measured\n1,9,0.5,3,3\n2,9,0.5,3,3\n");
  const Outcome far = folder.run(discover + "--apply found.json far.csv");
  EXPECT_NE(far.out.find("2 of 2 values of a lie outside of"), std::string::npos) << far.out;
  EXPECT_NE(far.out.find("The gap of y is larger with what was found"), std::string::npos) << far.out;
  const Outcome code = folder.run(discover + "--apply found.json --code c.c");
  EXPECT_EQ(code.exit_code, 1);
  EXPECT_NE(code.err.find("the term direction of a cannot be written as code: it depends on other rows than its own"),
            std::string::npos)
      << code.err;
}

TEST(DiscoverApply, AddsChangesOfParametersOnlyWhereItCan) {
  const Folder folder;
  write_cart(folder, 1.5);
  ASSERT_EQ(folder
                .run(discover + "s.csv m.csv -t tau --parameters by.csv --parameter mass=3 -o c.csv --code c.py --json "
                                "> found.json")
                .exit_code,
            0);
  const std::string apply = discover + "--apply found.json s.csv m.csv ";
  const Outcome refused = folder.run(apply + "-o again.csv");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("found.json changes parameters of the simulation (mass, damping)"), std::string::npos)
      << refused.err;
  ASSERT_EQ(folder.run(apply + "--parameters by.csv -o again.csv").exit_code, 0);
  const auto corrected = [&](const char* name) {
    return Eigen::VectorXd(llmt::Csv::read(folder.file(name)).numbers("tau_corrected"));
  };
  EXPECT_LT((corrected("again.csv") - corrected("c.csv")).cwiseAbs().maxCoeff(), 1e-9);
  ASSERT_EQ(folder.run(apply + "--parameters-are-set -o set.csv").exit_code, 0);
  EXPECT_GT((corrected("set.csv") - corrected("c.csv")).cwiseAbs().maxCoeff(), 0.5);
  const std::string code = llmt::read_file(folder.file("c.py"));
  EXPECT_NE(code.find("def correction(q, dq, ddq):"), std::string::npos) << code;
  EXPECT_NE(code.find("* (dq * np.abs(dq))"), std::string::npos) << code;
}

// What stands between ```language and ``` for the k-th time.
std::string example(const std::string& page, const std::string& language, int k) {
  std::size_t begin = 0;
  for (; k > 0; --k) begin = page.find("```" + language + "\n", begin) + language.size() + 4;
  return page.substr(begin, page.find("```\n", begin) - begin);
}

TEST(DiscoverApply, PrintsWhatThePageSays) {
  const Folder folder;
  const std::string whole = llmt::read_file(LLMT_DOCS "/discovery-generic.md");
  const std::string page = whole.substr(whole.find("## Parameters of the simulation"));
  const auto run = [&](std::string command) {
    EXPECT_TRUE(command.starts_with("llmt discover ")) << command;
    return folder.run(command.replace(0, std::string("llmt discover ").size(), discover));
  };
  ASSERT_EQ(folder.run(example(page, "sh", 1)).exit_code, 0);
  const std::string search = example(page, "sh", 2);
  ASSERT_EQ(run(search).exit_code, 0);
  const std::string printed = run(search.substr(0, search.find(" --json"))).out;
  std::istringstream lines(example(page, "text", 1));
  for (std::string line; std::getline(lines, line);) {
    EXPECT_NE(printed.find(line + "\n"), std::string::npos) << line << "\n" << printed;
  }
  EXPECT_NE(run(example(page, "sh", 3)).out.find("VERDICT: one term is missing: signed_square of "), std::string::npos);
  EXPECT_EQ(run(example(page, "sh", 4)).out, example(page, "text", 2));
}

TEST(DiscoverApply, MistakesAreNamed) {
  const Folder folder;
  write_cart(folder, 1.5, 1, false);
  ASSERT_EQ(folder.run(discover + "s.csv m.csv -t tau --json > found.json").exit_code, 0);
  folder.write("bad.json", "{\"inputs\": 3}");
  folder.write("text.json", "found");
  folder.write("evil.json", folder.run("sed 's/dq\\*abs(dq)/dq*abs(unknown)/' found.json").out);
  folder.write("no_dq.csv", "q,ddq,tau\n1,2,3\n");
  struct Case {
    std::string arguments;
    int exit_code;
    std::string message;
  };
  const std::vector<Case> cases = {
      {"--apply no.json s.csv -o c.csv", 1, "no.json"},
      {"--apply text.json s.csv -o c.csv", 1, "text.json: "},
      {"--apply bad.json s.csv -o c.csv", 1, "bad.json is not what llmt discover --json prints"},
      {"--apply evil.json s.csv -o c.csv", 1, "depends on \"unknown\", which is no input"},
      {"--apply found.json no_dq.csv -o c.csv", 1, "\"dq\""},
      {"--apply found.json s.csv", 2, "needs --output"},
      {"--apply found.json s.csv -t tau -o c.csv", 2, "--apply excludes --target"},
      {"--apply found.json s.csv --code c.txt", 2, "must end with .c or .py"},
      {"s.csv m.csv -t tau --parameters-are-set", 2, "--parameters-are-set needs --apply"},
      {"m.csv -t tau --simulate cat", 2, "--simulate needs the parameters that it may adjust"},
      {"s.csv m.csv -t tau --simulate cat --parameter m=1", 2, "--simulate takes the place of the file SIMULATED"},
      {"m.csv -t tau --simulate cat --parameter q=1", 2, "\"q\" is an input too"},
  };
  for (const Case& entry : cases) {
    const Outcome outcome = folder.run(discover + entry.arguments);
    EXPECT_EQ(outcome.exit_code, entry.exit_code) << entry.arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(entry.message), std::string::npos) << entry.arguments << "\n" << outcome.err;
  }
}

}  // namespace
