// Terms as expressions and as code: the same values as the library's columns.
#include "report/terms/found_terms.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/discovery/terms.hpp"
#include "llmt/random.hpp"
#include "report/terms/terms_summary.hpp"
#include "trees/term_file.hpp"

namespace {

using namespace llmt::report;
namespace discovery = llmt::discovery;

struct Sample {
  discovery::Inputs inputs{{"a", "b", "t", "turn_deg", "int", "motor temp"}, {}};
  Eigen::VectorXd simulated;
};

Sample sample() {
  constexpr Eigen::Index n = 60;
  llmt::Random random(5);
  Sample sample;
  sample.inputs.values.resize(n, 6);
  sample.simulated.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    sample.inputs.values.row(i) << random.uniform(-2.0, 5.0), random.uniform(0.1, 1.0), 0.5 * static_cast<double>(i),
        random.uniform(-180.0, 180.0), random.uniform(-1.0, 1.0), random.uniform(20.0, 90.0);
    sample.simulated(i) = random.uniform(-3.0, 3.0);
  }
  return sample;
}

bool is_history(const discovery::ModelTerm& term) {
  return term.family == "previous" || term.family == "rate" || term.family == "direction";
}

// Some term with some coefficients, as a search gives it.
discovery::FoundTerm found_of(const discovery::ModelTerm& term, llmt::Random& random) {
  discovery::FoundTerm found;
  found.family = term.family;
  found.location = term.location;
  found.output = "y";
  found.formula = term.formula;
  found.inputs = term.inputs;
  found.generic = term.generic;
  found.code = term.code;
  found.coefficients.resize(std::ssize(term.coefficients));
  for (double& value : found.coefficients) value = random.normal();
  found.constants.resize(std::ssize(term.constants));
  for (Eigen::Index c = 0; c < found.constants.size(); ++c) {
    const std::vector<double>& tried = term.constants[static_cast<std::size_t>(c)].tried;
    found.constants(c) = tried[static_cast<std::size_t>(random.uniform() * static_cast<double>(tried.size()))];
  }
  for (std::size_t k = 0; k < term.coefficients.size(); ++k) {
    found.values.push_back({term.coefficients[k], "y", found.coefficients(static_cast<Eigen::Index>(k)), 0.1});
  }
  return found;
}

Json json_of(const Sample& sample, std::vector<discovery::FoundTerm> found,
             discovery::Answer answer = discovery::Answer::named, const Eigen::MatrixXd& range_of_terms = {}) {
  TermsSummary summary;
  summary.inputs = sample.inputs.names;
  summary.ranges = ranges_of(sample.inputs);
  summary.order = sample.inputs.order;
  summary.missing.found = std::move(found);
  summary.missing.answer = answer;
  summary.missing.gaps = {{.output = "y"}};
  summary.missing.zero_bands = sample.inputs.zero_bands;
  summary.missing.range_of_terms = range_of_terms;
  return terms_json(summary);
}

Eigen::VectorXd truth(const discovery::ModelTerm& term, const discovery::FoundTerm& found,
                      const discovery::Rows& rows) {
  return term.columns(rows, found.constants) * found.coefficients;
}

double largest(const Eigen::VectorXd& values) { return values.cwiseAbs().maxCoeff(); }

TEST(FoundTerms, EveryTermOfTheLibraryIsAnExpressionThatTheTermFileReads) {
  const Sample own = sample();
  llmt::Random random(1);
  const discovery::Rows rows = discovery::rows_of(own.inputs, own.simulated);
  // What a file of terms may name.
  discovery::Inputs words = own.inputs;
  words.names = words_for({"a", "b", "t", "turn_deg", "int", "motor temp"});
  EXPECT_EQ(words.names[4], "int_");
  EXPECT_EQ(words.names[5], "motor_temp");
  int expressions = 0;
  for (const discovery::ModelTerm& term : discovery::standard_terms(own.inputs)) {
    if (is_history(term)) continue;
    const discovery::FoundTerm found = found_of(term, random);
    const Json report = json_of(own, {found});
    const Json& text = term.generic ? report["unknown_all"][0]["expression"] : report["effects"][0]["expression"];
    ASSERT_TRUE(text.is_string()) << term.family << " has no code";
    const std::vector<discovery::ModelTerm> read =
        llmt::apps::parse_terms("own = " + text.get<std::string>(), "terms", words, "y", rows, {});
    const Eigen::VectorXd expected = truth(term, found, rows);
    EXPECT_LE(largest(read.at(0).columns(rows, {}).col(0) - expected), 1e-12 * largest(expected)) << text;
    ++expressions;
  }
  EXPECT_GT(expressions, 100);
}

TEST(FoundTerms, AppliedAreTheSameAsTheLibrarysOwn) {
  Sample own = sample();
  own.inputs.order = "t";
  own.inputs.zero_bands = Eigen::VectorXd::Zero(6);
  own.inputs.zero_bands(4) = 0.3;  // a third of the rows
  llmt::Random random(2);
  const discovery::Rows rows = discovery::rows_of(own.inputs, own.simulated);
  std::vector<discovery::FoundTerm> all;
  Eigen::VectorXd expected = own.simulated;
  for (const discovery::ModelTerm& term : discovery::standard_terms(own.inputs)) {
    all.push_back(found_of(term, random));
    expected += truth(term, all.back(), rows);
  }
  const FoundTerms found = found_terms(json_of(own, all), "found.json");
  EXPECT_EQ(found.terms.size(), all.size());
  EXPECT_EQ(found.order, "t");
  const Eigen::MatrixXd applied = apply(found, own.inputs.values, own.simulated);
  EXPECT_LE(largest(applied.col(0) - expected), 1e-11 * largest(expected));
  try {
    correction_code(found, CodeLanguage::c);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("the term previous of a cannot be written as code"), std::string::npos)
        << error.what();
  }
}

// What the function in C adds at each row.
Eigen::VectorXd of_compiled(const program::Folder& folder, const FoundTerms& found, const Sample& sample) {
  folder.write("correction.c", correction_code(found, CodeLanguage::c));
  folder.write("main.c",
               "#include <stdio.h>\ndouble correction(double, double, double, double, double, double, double);\n"
               "int main(void) {\n  double x[7];\n"
               "  while (scanf(\"%lf %lf %lf %lf %lf %lf %lf\", x, x + 1, x + 2, x + 3, x + 4, x + 5, x + 6) == 7)\n"
               "    printf(\"%.17g\\n\", correction(x[0], x[1], x[2], x[3], x[4], x[5], x[6]));\n  return 0;\n}\n");
  std::string in;
  for (Eigen::Index i = 0; i < sample.simulated.size(); ++i) {
    for (const double value : sample.inputs.values.row(i)) in += fmt::format("{} ", value);
    in += fmt::format("{}\n", sample.simulated(i));
  }
  folder.write("in", in);
  const program::Outcome outcome = folder.run(
      "cc -std=c99 -O1 -Wall -Wextra -Werror -pedantic correction.c main.c -o correct -lm && echo y && ./correct < in");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return llmt::Csv::parse(outcome.out, "output").numbers("y");
}

TEST(FoundTerms, AsCAreTheSameFunction) {
  if (std::system("command -v cc >/dev/null") != 0) GTEST_SKIP() << "no C compiler";
  const program::Folder folder;
  Sample own = sample();
  own.inputs.zero_bands = Eigen::VectorXd::Zero(6);
  own.inputs.zero_bands(4) = 0.3;
  llmt::Random random(3);
  std::vector<discovery::FoundTerm> all;
  for (const discovery::ModelTerm& term : discovery::standard_terms(own.inputs)) {
    if (!is_history(term)) all.push_back(found_of(term, random));
  }
  const FoundTerms found = found_terms(json_of(own, all), "found.json");
  const Eigen::VectorXd code = of_compiled(folder, found, own);
  const Eigen::VectorXd expected = apply(found, own.inputs.values, own.simulated).col(0) - own.simulated;
  ASSERT_EQ(code.size(), expected.size());
  EXPECT_LE(largest(code - expected), 1e-12 * largest(expected));
}

// A law holds beyond the rows that it was found in; a function that was fitted to an unknown effect does not.
TEST(FoundTerms, OfAnUnknownEffectHoldWhereRowsEnd) {
  if (std::system("command -v cc >/dev/null") != 0) GTEST_SKIP() << "no C compiler";
  const program::Folder folder;
  const Sample own = sample();
  llmt::Random random(4);
  std::vector<discovery::FoundTerm> all;
  for (const discovery::ModelTerm& term : discovery::standard_terms(own.inputs)) {
    const bool is_of_b = std::ranges::find(term.inputs, "b") != term.inputs.end();
    if (!is_history(term) && is_of_b) all.push_back(found_of(term, random));
  }
  ASSERT_GT(all.size(), 20);
  const FoundTerms law = found_terms(json_of(own, all), "found.json");
  const FoundTerms fit = found_terms(json_of(own, all, discovery::Answer::unknown), "found.json");
  const auto added = [&](const FoundTerms& found, const Eigen::MatrixXd& inputs) {
    return Eigen::VectorXd(apply(found, inputs, own.simulated).col(0) - own.simulated);
  };
  EXPECT_EQ(added(law, own.inputs.values), added(fit, own.inputs.values));
  Sample far = own;
  far.inputs.values.col(1).array() = 0.1 + 3.0 * (far.inputs.values.col(1).array() - 0.1);
  const Eigen::MatrixXd held = far.inputs.values.cwiseMin(own.inputs.values.colwise().maxCoeff().replicate(60, 1));
  ASSERT_GT(largest(added(law, far.inputs.values) - added(law, held)), 0.1);
  EXPECT_EQ(added(fit, far.inputs.values), added(law, held));
  const Eigen::VectorXd code = of_compiled(folder, fit, far);
  EXPECT_LE(largest(code - added(law, held)), 1e-12 * largest(code));
  const program::Outcome failed = folder.run("echo 1 nan 1 1 1 30 0 | ./correct");  // as of a sensor
  EXPECT_NE(failed.out.find("nan"), std::string::npos) << failed.out;
}

TEST(FoundTerms, AddNoMoreThanWhereTheyWereFoundIfOneIsNotCertain) {
  if (std::system("command -v cc >/dev/null") != 0) GTEST_SKIP() << "no C compiler";
  const program::Folder folder;
  const Sample own = sample();
  llmt::Random random(4);
  std::vector<discovery::FoundTerm> two;
  for (const discovery::ModelTerm& term : discovery::standard_terms(own.inputs)) {
    const bool is_power = term.family == "linear" || term.family == "square";
    if (!is_power || term.location != "a") continue;
    two.push_back(found_of(term, random));
    two.back().coefficients(0) = two.back().values[0].value = term.family == "square" ? 1.0 : -1.0;
  }
  ASSERT_EQ(two.size(), 2U);
  two[0].confirmed = true;
  const auto found = [&] {
    return found_terms(json_of(own, two, discovery::Answer::undecided, Eigen::RowVector2d(-0.1, 0.7)), "found.json");
  };
  const auto added = [&](const FoundTerms& terms) {
    return Eigen::VectorXd(apply(terms, own.inputs.values, own.simulated).col(0) - own.simulated);
  };
  const FoundTerms uncertain = found();
  two[1].confirmed = true;
  const Eigen::VectorXd all = added(found());
  ASSERT_LT(all.minCoeff(), -0.2);
  ASSERT_GT(all.maxCoeff(), 0.8);
  const Eigen::VectorXd held = all.cwiseMax(-0.1).cwiseMin(0.7);
  EXPECT_LE(largest(added(uncertain) - held), 1e-12);
  EXPECT_LE(largest(of_compiled(folder, uncertain, own) - held), 1e-12);
  EXPECT_NE(correction_code(uncertain, CodeLanguage::python).find("np.clip(terms, -0.1, 0.7)"), std::string::npos);
}

TEST(ExpressionCode, KeepsTheOrderOfOperators) {
  const std::vector<std::string> x = {"x", "y"};
  const auto c = [&](const std::string& text) { return translated(text, x, CodeLanguage::c); };
  const auto python = [&](const std::string& text) { return translated(text, x, CodeLanguage::python); };
  EXPECT_EQ(c("1 - (x - 2)*y"), "1.0 - (x - 2.0) * y");
  EXPECT_EQ(c("-x^2"), "-pow(x, 2.0)");
  EXPECT_EQ(c("2^-x"), "pow(2.0, -x)");
  EXPECT_EQ(c("0.5*(x > 1e-3)"), "0.5 * (x > 1e-3 ? 1.0 : 0.0)");
  EXPECT_EQ(c("sign(x)*max(0, abs(y))"), "llmt_sign(x) * fmax(0.0, fabs(y))");
  EXPECT_EQ(python("-x^2/y"), "-(x ** 2.0) / y");
  EXPECT_EQ(python("3*(x <= y)"), "3.0 * (np.where(x <= y, 1.0, 0.0))");
  const auto refused = [&](const std::string& text) {
    try {
      c(text);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refused("x > 1 ? 2 : 3"), "\"? 2 : 3\" in \"x > 1 ? 2 : 3\" has no counterpart in C");
  EXPECT_EQ(refused("rint(x)"), "rint() in \"rint(x)\" has no counterpart in C");
  EXPECT_EQ(refused("z + 1"), "\"z\" in \"z + 1\" has no counterpart in C");
  EXPECT_EQ(refused("max(1, x, y)"), "max() of 3 arguments in \"max(1, x, y)\" has no counterpart in C");
  EXPECT_EQ(refused("x +"), "the end in \"x +\" has no counterpart in C");
}

TEST(ExpressionCode, WordsAreDifferentAndMeanNothingElse) {
  EXPECT_EQ(words_for({"q 1", "q_1", "sin", "2x", "load"}),
            (std::vector<std::string>{"q_1_2", "q_1", "sin_", "x2x", "load"}));
}

}  // namespace
