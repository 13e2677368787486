// llmt fit --readable and llmt inspect --rules as a user runs them. What is printed is read back by an evaluator of its
// own, which knows rules and equations and nothing of models.
#include <fmt/format.h>

#include <Eigen/QR>
#include <cctype>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/programs.hpp"
#include "llmt/csv.hpp"
#include "llmt/files.hpp"
#include "llmt/random.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::llmt_program;
using program::Outcome;

// A row of a table: numbers, and words.
struct Row {
  std::map<std::string, double> numbers;
  std::map<std::string, std::string> words;
};

// 400 rows: y bends in a, has a product for green rows, and does not depend on e.
std::vector<Row> rows(std::uint64_t seed = 21) {
  llmt::Random random(seed);
  const std::vector<std::string> colours = {"red", "green", "blue"};
  std::vector<Row> result(400);
  for (std::size_t i = 0; i < result.size(); ++i) {
    Row& row = result[i];
    const double a = random.uniform(50.0, 90.0);
    const double b = random.uniform(-2.0, 1.0);
    row.words["colour"] = colours[i % 3];
    const double bent = row.words["colour"] == "green" ? 30.0 + a * b : std::abs(a - 70.0) + 4.0 * b;
    row.numbers = {{"a", a}, {"b", b}, {"e", random.normal()}, {"y", bent + 0.2 * random.normal()}};
  }
  return result;
}

std::string text_of(const std::vector<Row>& rows) {
  std::string text = "a,b,colour,e,y\n";
  for (const Row& row : rows) {
    text += fmt::format("{},{},{},{},{}\n", row.numbers.at("a"), row.numbers.at("b"), row.words.at("colour"),
                        row.numbers.at("e"), row.numbers.at("y"));
  }
  return text;
}

// Reads the text of `inspect --rules` and evaluates it.
class PrintedRules {
 public:
  explicit PrintedRules(const std::string& text) {
    std::istringstream lines(text);
    std::string line;
    while (std::getline(lines, line) && !line.starts_with("As a tree:")) {
      EXPECT_LE(line.size(), 100u) << line;
      if (line.starts_with("Rule ")) {
        rules_.emplace_back();
        rules_.back().condition = line.substr(line.find("): ") + 3);
        open_ = &rules_.back().condition;
      } else if (line.starts_with("  y = ")) {
        rules_.back().equation = line.substr(6);
        open_ = &rules_.back().equation;
      } else if (line.starts_with("    ") && open_ != nullptr) {
        *open_ += " " + line.substr(line.find_first_not_of(' '));  // a line that was wrapped
      } else {
        open_ = nullptr;
      }
    }
  }

  std::size_t count() const { return rules_.size(); }

  // By the only rule that holds.
  double operator()(const Row& row) const {
    double y = std::nan("");
    int holding = 0;
    for (const Rule& rule : rules_) {
      if (!holds(rule.condition, row)) continue;
      ++holding;
      y = value(rule.equation, row);
    }
    EXPECT_EQ(holding, 1);
    return y;
  }

 private:
  struct Rule {
    std::string condition;
    std::string equation;
  };

  static std::vector<std::string> words_of(const std::string& text) {
    std::istringstream stream(text);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) words.push_back(word);
    return words;
  }

  // "if 3 < a <= 21 and colour in {red, blue} and town = Brno", "everywhere".
  static bool holds(const std::string& condition, const Row& row) {
    if (condition == "everywhere") return true;
    EXPECT_TRUE(condition.starts_with("if ")) << condition;
    std::string rest = condition.substr(3);
    while (!rest.empty()) {
      const std::size_t end = rest.find(" and ");
      const std::string part = rest.substr(0, end);
      rest = end == std::string::npos ? "" : rest.substr(end + 5);
      if (const std::size_t in = part.find(" in {"); in != std::string::npos) {
        const std::string levels = ", " + part.substr(in + 5, part.size() - in - 6) + ", ";
        const bool is_not = in >= 4 && part.substr(in - 4, 4) == " not";
        const std::string& word = row.words.at(part.substr(0, is_not ? in - 4 : in));
        if ((levels.find(", " + word + ", ") == std::string::npos) != is_not) return false;
        continue;
      }
      if (const std::size_t is = part.find(" = "); is != std::string::npos) {
        if (row.words.at(part.substr(0, is)) != part.substr(is + 3)) return false;
        continue;
      }
      const std::vector<std::string> words = words_of(part);
      for (std::size_t i = 1; i < words.size(); i += 2) {
        const auto read = [&](const std::string& word) {
          return row.numbers.contains(word) ? row.numbers.at(word) : std::stod(word);
        };
        const double left = read(words[i - 1]);
        const double right = read(words[i + 1]);
        if (words[i] == "<=" ? !(left <= right) : words[i] == "<" ? !(left < right) : !(left > right)) return false;
      }
    }
    return true;
  }

  // "x" or "(x - 0.5)", from `at` on.
  static double factor(const std::string& text, std::size_t& at, const Row& row) {
    const auto name = [&] {
      const std::size_t begin = at;
      while (at < text.size() && (std::isalnum(static_cast<unsigned char>(text[at])) != 0)) ++at;
      return row.numbers.at(text.substr(begin, at - begin));
    };
    if (text[at] != '(') return name();
    ++at;
    const double x = name();
    const std::size_t close = text.find(')', at);
    const double centre = std::stod(text.substr(at + 3, close - at - 3));
    const double result = text[at + 1] == '-' ? x - centre : x + centre;
    at = close + 1;
    return result;
  }

  // "12.3 + 0.45 a - 1.2 [colour = red] + 3 (a - 70)*(b + 0.5)".
  static double value(const std::string& equation, const Row& row) {
    std::size_t at = 0;
    double sum = std::stod(equation, &at);
    while (at < equation.size()) {
      const double sign = equation[at + 1] == '-' ? -1.0 : 1.0;
      at += 3;
      std::size_t length = 0;
      const double slope = std::stod(equation.substr(at), &length);
      at += length + 1;
      double term = 0.0;
      if (equation[at] == '[') {
        const std::size_t close = equation.find(']', at);
        const std::string inside = equation.substr(at + 1, close - at - 1);
        const std::size_t equals = inside.find(" = ");
        term = row.words.at(inside.substr(0, equals)) == inside.substr(equals + 3) ? 1.0 : 0.0;
        at = close + 1;
      } else {
        term = factor(equation, at, row);
        if (at < equation.size() && equation[at] == '*') {
          ++at;
          term *= factor(equation, at, row);
        } else if (at < equation.size() && equation[at] == '^') {
          term *= term;
          at += 2;
        }
      }
      sum += sign * slope * term;
    }
    return sum;
  }

  std::vector<Rule> rules_;
  std::string* open_ = nullptr;
};

TEST(ReadableProgram, WhatIsPrintedIsWhatIsPredicted) {
  const Folder folder;
  const std::vector<Row> data = rows();
  folder.write("d.csv", text_of(data));
  for (const char* terms : {"linear", "quadratic"}) {
    const Outcome fitted = folder.run(fmt::format(
        "{} fit d.csv -t y -o m.json --validity crisp --local-models {} --readable=2 --json", llmt_program, terms));
    ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
    const json readable = json::parse(fitted.out)["readable"][0];
    const Outcome printed = folder.run(llmt_program + " inspect m.readable.json --rules");
    ASSERT_EQ(printed.exit_code, 0) << printed.err;
    const PrintedRules rules(printed.out);
    EXPECT_EQ(rules.count(), readable["leaves"]);
    EXPECT_GT(rules.count(), 1u);
    EXPECT_NE(printed.out.find(fmt::format("size {} ", readable["size"].get<int>())), std::string::npos);
    ASSERT_EQ(folder.run(llmt_program + " predict m.readable.json d.csv -o p.csv").exit_code, 0);
    const llmt::Csv predicted = llmt::Csv::read(folder.file("p.csv"));
    const Eigen::VectorXd y = predicted.numbers("y_pred");
    for (std::size_t i = 0; i < data.size(); ++i) EXPECT_NEAR(rules(data[i]), y(i), 1e-9 * (1.0 + std::abs(y(i))));
  }
}

// The numbers in the line of `text` that begins so.
std::vector<double> figures_behind(const std::string& begin, const std::string& text) {
  const std::size_t at = text.find("\n" + begin);
  if (at == std::string::npos) return {};
  std::istringstream line(text.substr(at + 1 + begin.size(), text.find('\n', at + 1) - at - 1 - begin.size()));
  std::vector<double> figures;
  for (double figure = 0.0; line >> figure;) figures.push_back(figure);
  return figures;
}

Eigen::MatrixXd regressors_of(const std::vector<Row>& rows) {
  Eigen::MatrixXd result(rows.size(), 6);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string& colour = rows[i].words.at("colour");
    result.row(static_cast<int>(i)) << 1.0, rows[i].numbers.at("a"), rows[i].numbers.at("b"), rows[i].numbers.at("e"),
        colour == "red", colour == "green";
  }
  return result;
}

Eigen::VectorXd outputs_of(const std::vector<Row>& rows) {
  Eigen::VectorXd result(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) result(static_cast<int>(i)) = rows[i].numbers.at("y");
  return result;
}

TEST(ReadableProgram, TheFileIsAnOrdinaryModelAndTheSummarySaysWhatEachCosts) {
  const Folder folder;
  folder.write("d.csv", text_of(rows()));
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y -o m.json --readable --cv 3");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  for (const char* text :
       {"readable", "least squares", "at most 15 % above", "m.readable.json",
        "The readable tree has a smaller held-out error than the model chosen above."}) {
    EXPECT_NE(fitted.out.find(text), std::string::npos) << fitted.out;
  }
  // Held-out errors are those of rows that the fit has not seen, here by the printed rules and by least squares.
  const PrintedRules rules(folder.run(llmt_program + " inspect m.readable.json --rules").out);
  const std::vector<Row> learned = rows();
  const std::vector<Row> fresh = rows(22);
  const Eigen::VectorXd plane = regressors_of(learned).colPivHouseholderQr().solve(outputs_of(learned));
  Eigen::VectorXd of_rules(400);
  for (int i = 0; i < 400; ++i) of_rules(i) = rules(fresh[i]);
  const auto rmse = [&](const Eigen::VectorXd& predicted) {
    return std::sqrt((predicted - outputs_of(fresh)).squaredNorm() / 400.0);
  };
  const std::vector<double> readable = figures_behind("        readable ", fitted.out);
  const std::vector<double> linear = figures_behind("        least squares ", fitted.out);
  ASSERT_EQ(readable.size(), 5) << fitted.out;  // leaves, terms of a leaf, size, held-out RMSE and its spread
  EXPECT_EQ(readable[0], static_cast<double>(rules.count()));
  EXPECT_NEAR(readable[3] / rmse(of_rules), 1.0, 0.25);
  ASSERT_EQ(linear.size(), 5) << fitted.out;
  EXPECT_EQ(linear[0], 1.0);
  EXPECT_NEAR(linear[3] / rmse(regressors_of(fresh) * plane), 1.0, 0.05);
  const std::vector<double> crisp = figures_behind("  against  crisp tree ", fitted.out);
  ASSERT_GE(crisp.size(), 2) << fitted.out;
  EXPECT_LE(readable[3], 1.25 * crisp[1]);
  EXPECT_EQ(folder.run(llmt_program + " predict m.readable.json d.csv --interval 0.9").exit_code, 0);
  EXPECT_EQ(folder.run(llmt_program + " explain m.readable.json d.csv").exit_code, 0);
  const Outcome leaves = folder.run(llmt_program + " inspect m.readable.json");
  EXPECT_NE(leaves.out.find("each holds in its box alone"), std::string::npos) << leaves.out;
  const Outcome without_file = folder.run(llmt_program + " fit d.csv -t y --readable=50 --validity crisp --cv 3");
  EXPECT_NE(without_file.out.find("at most 50 % above"), std::string::npos) << without_file.out;
  EXPECT_EQ(without_file.out.find("written to"), std::string::npos) << without_file.out;
}

TEST(ReadableProgram, ThePriceIsSaidBesideTheChosenModel) {
  const Folder folder;
  llmt::Random random(8);
  std::string text = "a,y\n";
  for (int i = 0; i < 400; ++i) {
    const double a = random.uniform(-3.0, 3.0);
    text += fmt::format("{},{}\n", a, 10.0 * std::sin(2.0 * a) + 0.2 * random.normal());  // blends are better
  }
  folder.write("d.csv", text);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --readable=200");
  const std::size_t begin = fitted.out.find("Reading costs ");
  ASSERT_NE(begin, std::string::npos) << fitted.out;
  double cost = 0.0, low = 0.0, high = 0.0, readable = 0.0, chosen = 0.0;
  constexpr const char* sentence =
      "Reading costs %lf %% more error (over the folds %lf to %lf %%): RMSE held-out %lf in the place of %lf.";
  ASSERT_EQ(std::sscanf(fitted.out.c_str() + begin, sentence, &cost, &low, &high, &readable, &chosen), 5);
  EXPECT_NEAR(cost, 100.0 * (readable / chosen - 1.0), 0.6);
  EXPECT_LE(low, cost);
  EXPECT_GE(high, cost);
  const json summary = json::parse(folder.run(llmt_program + " fit d.csv -t y --readable=200 --json").out);
  EXPECT_NEAR(summary["readable"][0]["cv_rmse"].get<double>(), readable, 5e-4 * readable);
  EXPECT_NEAR(summary["partitions"][0]["cv_rmse"].get<double>(), chosen, 5e-4 * chosen);
  EXPECT_GT(summary["partitions"][0]["importance"][0][0]["increase"].get<double>(), 5.0);
}

TEST(ReadableProgram, EveryStepIsPrintedAndCanBeTaken) {
  const Folder folder;
  llmt::Random random(9);
  std::string text = "a,b,y\n";
  for (int i = 0; i < 500; ++i) {
    const double a = random.uniform(0.0, 6.0);
    const double b = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", a, b, 3.0 * std::sin(1.5 * a) + b + 0.2 * random.normal());
  }
  folder.write("d.csv", text);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --readable -o m.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json summary = json::parse(folder.run(llmt_program + " fit d.csv -t y --readable --json").out);
  const json& readable = summary["readable"][0];
  ASSERT_GE(readable["path"].size(), 3u);
  std::istringstream lines(fitted.out.substr(fitted.out.find("above the model")));
  std::string line;
  std::getline(lines, line);
  for (std::size_t k = 0; k < readable["path"].size(); ++k) {
    const json& step = readable["path"][k];
    if (step["leaves"] > 12 && k != readable["taken"]) continue;
    std::getline(lines, line);
    std::istringstream words(line.substr(line.find_first_of(" 0123456789")));
    int rules = 0, terms = 0, size = 0;
    double rmse = 0.0, above = 0.0;
    words >> rules >> terms >> size >> rmse >> above;
    EXPECT_EQ(rules, step["leaves"]) << line;
    EXPECT_EQ(terms, step["most_terms"]) << line;
    EXPECT_EQ(size, step["size"]) << line;
    EXPECT_NEAR(above, 100.0 * step["above_model"].get<double>(), 0.51) << line;
    EXPECT_EQ(line.find("taken") != std::string::npos, k == readable["taken"]) << line;
  }
  for (const json& sentence : readable["sentences"])
    EXPECT_NE(fitted.out.find(sentence.get<std::string>()), std::string::npos) << sentence;
  const int rules = readable["path"][1]["leaves"];
  const Outcome taken =
      folder.run(fmt::format("{} fit d.csv -t y --readable-rules {} -o few.json", llmt_program, rules));
  ASSERT_EQ(taken.exit_code, 0) << taken.err;
  EXPECT_NE(taken.out.find("as asked"), std::string::npos) << taken.out;
  EXPECT_EQ(PrintedRules(folder.run(llmt_program + " inspect few.readable.json --rules").out).count(),
            static_cast<std::size_t>(rules));
}

TEST(ReadableProgram, BeyondADozenRulesNoShortTreeIsNear) {
  const Folder folder;
  llmt::Random random(10);
  std::string text = "a,y\n";
  for (int i = 0; i < 1500; ++i) {
    const double a = random.uniform(0.0, 20.0);
    text += fmt::format("{},{}\n", a, std::floor(a) * (static_cast<int>(a) % 2 == 0 ? 1.0 : -1.0) + 0.1 * random.normal());
  }
  folder.write("d.csv", text);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --readable --validity crisp");
  EXPECT_NE(fitted.out.find("rules are more than a person reads: no short tree is near."), std::string::npos) << fitted.out;
  const Outcome few = folder.run(llmt_program + " fit d.csv -t y --readable-rules 5 --validity crisp");
  EXPECT_EQ(few.out.find("no short tree is near"), std::string::npos) << few.out;
}

TEST(ReadableProgram, KeepsAMonotoneInput) {
  const Folder folder;
  llmt::Random random(11);
  std::string text = "a,b,y\n";
  std::string asked = "a,b\n";
  for (int i = 0; i < 400; ++i) {
    const double a = random.uniform(0.0, 10.0);
    const double b = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", a, b, (a > 6.0 ? 8.0 : a) - (a > 3.0 && a < 4.0 ? 3.0 : 0.0) + b + 0.3 * random.normal());
    asked += fmt::format("{},0.3\n", 0.03 * i - 1.0);
  }
  folder.write("d.csv", text);
  folder.write("asked.csv", asked);
  const Outcome fitted = folder.run(llmt_program + " fit d.csv -t y --readable --monotone a -o m.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  ASSERT_EQ(folder.run(llmt_program + " predict m.readable.json asked.csv -o p.csv").exit_code, 0);
  const Eigen::VectorXd y = llmt::Csv::read(folder.file("p.csv")).numbers("y_pred");
  EXPECT_GT(y(399) - y(0), 3.0);
  EXPECT_LE((y.head(399) - y.tail(399)).maxCoeff(), 1e-12);
}

TEST(ReadableProgram, InputsFarFromZeroAreCountedFromTheirMiddle) {
  const Folder folder;
  llmt::Random random(14);
  std::string text = "seconds,b,y\n";
  std::vector<Row> data(300);
  for (Row& row : data) {
    row.numbers["seconds"] = 1.7e9 + std::floor(random.uniform(0.0, 1e6));
    row.numbers["b"] = random.uniform(-1.0, 1.0);
    row.numbers["y"] = 20.0 + 3e-6 * (row.numbers["seconds"] - 1.7e9) + row.numbers["b"] + 0.1 * random.normal();
    text += fmt::format("{},{},{}\n", row.numbers["seconds"], row.numbers["b"], row.numbers["y"]);
  }
  folder.write("d.csv", text);
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json --validity crisp --max-leaves 2").exit_code, 0);
  ASSERT_EQ(folder.run(llmt_program + " predict m.json d.csv -o p.csv").exit_code, 0);
  const Outcome printed = folder.run(llmt_program + " inspect m.json --rules");
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_NE(printed.out.find("(seconds - 1700"), std::string::npos) << printed.out;
  const PrintedRules rules(printed.out);
  const Eigen::VectorXd y = llmt::Csv::read(folder.file("p.csv")).numbers("y_pred");
  // Five digits of every number: 1e-4 of what the terms move.
  for (std::size_t i = 0; i < data.size(); ++i) EXPECT_NEAR(rules(data[i]), y(static_cast<int>(i)), 5e-3);
}

TEST(ReadableProgram, LongSetsOfCategoriesAreNamedOnce) {
  const Folder folder;
  llmt::Random random(16);
  std::string text = "town,a,y\n";
  for (int i = 0; i < 600; ++i) {
    const int town = i % 16;
    const double a = random.uniform(0.0, 10.0);
    const double y = town % 2 == 0 ? (a > 5.0 ? 30.0 - a : a) : (a > 3.0 ? -20.0 + a : 3.0 * a);
    text += fmt::format("town_number_{},{},{}\n", town, a, y + 0.1 * random.normal());
  }
  folder.write("d.csv", text);
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json --readable=5").exit_code, 0);
  const Outcome printed = folder.run(llmt_program + " inspect m.readable.json --rules");
  const std::string& out = printed.out;
  ASSERT_NE(out.find("set 1 = {town_number_"), std::string::npos) << out;
  EXPECT_NE(out.find("town in set 1"), std::string::npos) << out;
  const std::string set = out.substr(out.find("= {") + 2, out.find("}", out.find("= {")) - out.find("= {") - 1);
  EXPECT_EQ(out.find(set, out.find(set) + 1), std::string::npos) << set;
}

TEST(ReadableProgram, IsExportedAsIfAndEquations) {
  const Folder folder;
  const std::vector<Row> data = rows();
  folder.write("d.csv", text_of(data));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o m.json --readable=2").exit_code, 0);
  ASSERT_EQ(folder.run(llmt_program + " predict m.readable.json d.csv -o p.csv").exit_code, 0);
  const Outcome python =
      folder.run(llmt_program + " export m.readable.json --plain python --name heat -o heat.py");
  ASSERT_EQ(python.exit_code, 0) << python.err;
  const std::string source = llmt::read_file(folder.file("heat.py"));
  EXPECT_NE(source.find("def heat_y(a, b, colour):"), std::string::npos) << source;
  EXPECT_NE(source.find("    if "), std::string::npos) << source;
  EXPECT_NE(folder.run(llmt_program + " export m.json --plain sql -o no.sql").err.find("more than its rules"),
            std::string::npos);
  EXPECT_EQ(folder.run(llmt_program + " export m.readable.json --plain cobol -o no.cob").exit_code, 2);
  EXPECT_EQ(folder.run(llmt_program + " export m.readable.json -o no.c").exit_code, 2);
}

TEST(ReadableProgram, WrongUseIsRefusedBeforeTheWork) {
  const Folder folder;
  folder.write("d.csv", text_of(rows()));
  const auto refused = [&](const std::string& arguments, const std::string& message) {
    const Outcome outcome = folder.run(llmt_program + " fit d.csv -t y " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
  };
  for (const char* value : {"nan", "-1", "inf", "ten"}) {
    refused(fmt::format("--readable={}", value),
            fmt::format("--readable is \"{}\", it must be a number of per cent from 0 to 1000", value));
  }
  refused("--readable --cv 0", "--readable does not go with --cv 0");
  refused("--readable --validity blend", "--readable does not go with --validity blend");
  refused("--readable --rule lolimot", "--readable does not go with --rule lolimot");
  for (const char* value : {"0", "-2", "1.5", "few"})
    refused(fmt::format("--readable-rules {}", value), "--readable-rules");
  refused("--readable-rules 3 --stream", "--readable-rules is not for --stream");
  refused("--readable --stream", "--readable is not for --stream");
}

TEST(ReadableProgram, ARowAloneLeavesNoneToHoldOut) {
  const Folder folder;
  folder.write("one.csv", "x,y\n1,2\n");
  const Outcome outcome = folder.run(llmt_program + " fit one.csv -t y --readable");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_NE(outcome.err.find("one.csv: --readable chooses on held-out rows"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("::"), std::string::npos) << outcome.err;
}

TEST(ReadableProgram, RulesOfABlendAreRefusedAndOfOtherTreesSayWhatTheyLeaveOut) {
  const Folder folder;
  folder.write("d.csv", text_of(rows()));
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o blend.json --validity blend --cv 3").exit_code, 0);
  const Outcome blend = folder.run(llmt_program + " inspect blend.json --rules");
  EXPECT_EQ(blend.exit_code, 1);
  EXPECT_EQ(blend.out, "");
  EXPECT_NE(blend.err.find("blended"), std::string::npos) << blend.err;
  ASSERT_EQ(folder.run(llmt_program + " fit d.csv -t y -o crisp.json --validity crisp --cv 3").exit_code, 0);
  const Outcome crisp = folder.run(llmt_program + " inspect crisp.json --rules");
  EXPECT_EQ(crisp.exit_code, 0) << crisp.err;
  EXPECT_NE(crisp.out.find("the slopes of larger regions take"), std::string::npos) << crisp.out;
  EXPECT_EQ(folder.run(llmt_program + " inspect crisp.json --rules --json").exit_code, 2);
}

}  // namespace
