/// \file
/// The text of `llmt inspect --rules`, read back by an evaluator of its own, which knows rules and equations and
/// nothing of models.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "llmt/random.hpp"

namespace printed {

// A row of a table: numbers, and words.
struct Row {
  std::map<std::string, double> numbers;
  std::map<std::string, std::string> words;
};

// 400 rows: y bends in a, has a product for green rows, and does not depend on e.
inline std::vector<Row> rows(std::uint64_t seed = 21) {
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

inline std::string text_of(const std::vector<Row>& rows) {
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

}  // namespace printed
