// llmt discover with names that mean something in C, and with names of any length: what it writes is taken back.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "apps/program.hpp"
#include "llmt/c_code.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"
#include "report/terms/expression_code.hpp"

namespace {

using program::Folder;
using program::Outcome;

const std::string find_terms = LLMT_PROGRAM " discover ";

// A step of the first column and a slope of the second are missing. Writes s.csv and m.csv.
void write_tables(const Folder& folder, const std::vector<std::string>& names) {
  llmt::Random random(9);
  const std::string header = fmt::format("{},power\n", llmt::csv_row(names));
  std::string simulated = header;
  std::string measured = header;
  for (int i = 0; i < 120; ++i) {
    const double a = random.uniform(0.0, 10.0);
    const double b = random.uniform(-2.0, 2.0);
    simulated += fmt::format("{},{},{}\n", a, b, a * b);
    measured += fmt::format("{},{},{}\n", a, b, a * b + 3.0 * (a > 6.5) + 0.8 * b + 0.01 * random.normal());
  }
  folder.write("s.csv", simulated);
  folder.write("m.csv", measured);
}

bool has_compiler() { return std::system("command -v cc >/dev/null") == 0; }

// Values of the correction in C at rows of s.csv, and what --apply adds to them.
void expect_code_to_be_what_apply_adds(const Folder& folder, const std::string& name) {
  write_tables(folder, {name, "speed"});
  const Outcome found =
      folder.run(find_terms + "s.csv m.csv -t power --only step,linear --code c.c --json > found.json");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const Outcome applied = folder.run(find_terms + "s.csv --apply found.json -o corrected.csv");
  ASSERT_EQ(applied.exit_code, 0) << applied.err;
  const llmt::Csv corrected = llmt::Csv::read(folder.file("corrected.csv"));
  const Eigen::VectorXd added = corrected.numbers("power_corrected") - corrected.numbers("power_simulated");
  EXPECT_GT(added.cwiseAbs().maxCoeff(), 1.0) << "nothing was found";
  if (!has_compiler()) return;
  folder.write("main.c",
               "#include <stdio.h>\ndouble correction(double, double);\nint main(void) {\n  double a, b;\n"
               "  puts(\"y\");\n  while (scanf(\"%lf,%lf,%*f\", &a, &b) == 2) printf(\"%.17g\\n\", correction(a, b));\n"
               "  return 0;\n}\n");
  const Outcome run =
      folder.run("cc -std=gnu17 -D_GNU_SOURCE -Wall -Wextra -Werror c.c main.c -o c -lm && tail -n +2 s.csv | ./c");
  ASSERT_EQ(run.exit_code, 0) << name << ": " << run.err;
  const Eigen::VectorXd by_code = llmt::Csv::parse(run.out, "output").numbers("y");
  ASSERT_EQ(by_code.size(), added.size());
  EXPECT_LT((by_code - added).cwiseAbs().maxCoeff(), 1e-9) << name;
}

TEST(DiscoverNames, ThatAreMacrosMeanInputsInC) {
  const Folder folder;
  for (const char* name : {"INFINITY", "HUGE_VAL", "NAN", "M_PI", "FP_NAN", "MATH_ERRNO", "linux", "isnan", "typeof"}) {
    expect_code_to_be_what_apply_adds(folder, name);
  }
}

TEST(DiscoverNames, OfAnyLengthAreTakenBack) {
  const Folder folder;
  for (const std::size_t length : {99U, 100U, 101U, 130U, 2000U}) {
    expect_code_to_be_what_apply_adds(folder, std::string(length, 'q'));
  }
  expect_code_to_be_what_apply_adds(folder, std::string(150, '%'));
}

TEST(WordsOfNames, AreDifferentAndAtMostAHundredLetters) {
  const std::string stem(200, 'a');
  std::vector<std::string> names = {std::string(100, 'a'), "INFINITY_", "INFINITY"};
  for (int k = 0; k < 120; ++k) names.push_back(stem + std::to_string(k));
  const std::vector<std::string> words = llmt::report::words_for(names);
  EXPECT_EQ(words[0], names[0]);
  EXPECT_EQ(words[1], "INFINITY_");
  EXPECT_EQ(words[2], "INFINITY__2");
  EXPECT_EQ(std::set<std::string>(words.begin(), words.end()).size(), names.size());
  for (const std::string& word : words) {
    EXPECT_LE(word.size(), 100U);
    EXPECT_FALSE(llmt::is_c_word(word)) << word;
  }
}

// The preprocessor says what math.h defines.
TEST(WordsOfC, AreAllThatMathDefines) {
  if (!has_compiler()) GTEST_SKIP() << "no C compiler";
  const Folder folder;
  folder.write("m.c", "#include <math.h>\n");
  int macros = 0;
  for (const char* flags : {"-std=c99", "-std=gnu17", "-std=gnu17 -D_GNU_SOURCE", "-std=c2x -D_GNU_SOURCE"}) {
    const Outcome outcome = folder.run(fmt::format("cc {} -dM -E m.c", flags));
    if (outcome.exit_code != 0) continue;  // a compiler that does not know the standard
    std::istringstream lines(outcome.out);
    for (std::string line; std::getline(lines, line);) {
      const std::string name = line.substr(8, line.find_first_of(" (", 8) - 8);  // behind #define
      if (name.starts_with('_')) continue;  // names of inputs get a letter before it
      ++macros;
      EXPECT_TRUE(llmt::is_c_word(name)) << name;
    }
  }
  EXPECT_GT(macros, 30);
  for (const char* name : {"M_1", "FP", "FP_power", "power", "M_PIx", "speed", "infinity", "HUGE_value", "arm", "pi"}) {
    EXPECT_FALSE(llmt::is_c_word(name)) << name;
  }
  for (const char* name : {"INFINITY", "while", "M_PI", "alignas"}) EXPECT_FALSE(llmt::is_c_identifier(name)) << name;
}

TEST(OwnTerms, ThatAreTooLargeAreRefusedByTheirLine) {
  const Folder folder;
  write_tables(folder, {"a", "b"});
  folder.write("terms.txt", "# own terms\nsmall = a * 1e140\nlarge = 1e308 * (a > -1)\n");
  const Outcome outcome = folder.run(find_terms + "s.csv m.csv -t power --terms terms.txt");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(
      outcome.err,
      "llmt: terms.txt:3: large: \"1e308 * (a > -1)\" is 1e+308 at data row 1, the largest magnitude is 1e+150\n");
}

}  // namespace
