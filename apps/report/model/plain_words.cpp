#include "report/model/plain_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "report/model/plain_text.hpp"
#include "report/model/rule_text.hpp"

namespace llmt::report {
namespace {

constexpr std::size_t source_width = 100;

}  // namespace

std::string spaces(int depth) { return std::string(2 * static_cast<std::size_t>(depth), ' '); }

std::string plain_letters(const std::string& wish) {
  std::string text;
  for (const char c : wish) {
    const bool stays = std::isalnum(static_cast<unsigned char>(c)) != 0 && static_cast<unsigned char>(c) < 128;
    if (stays || text.empty() || text.back() != '_') text += stays ? c : '_';
  }
  if (text.empty() || std::isdigit(static_cast<unsigned char>(text.front())) != 0) text.insert(0, "x");
  return text;
}

std::string wrapped_equation(const std::string& equation, const std::string& indent) {
  std::string text;
  std::size_t length = indent.size();
  for (std::size_t at = 0; at < equation.size();) {
    std::size_t end = equation.find(" + ", at + 3);
    end = std::min({end, equation.find(" - ", at + 3), equation.size()});
    const std::string term = equation.substr(at, end - at);
    if (length + term.size() > source_width && !text.empty()) {
      text += "\n" + indent;
      length = indent.size() - 1;
      text += term.substr(1);
    } else {
      text += term;
    }
    length += term.size();
    at = end;
  }
  return text;
}

std::string in_comment(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < ' ' || c == '*' || c == '\\') c = '_';
  }
  return text;
}

NamedLevels named_levels(const InputColumn& input, const std::vector<int>& levels,
                         const std::function<std::string(const std::string&)>& in_quotes) {
  NamedLevels result;
  for (const int level : levels) {
    const std::string& name = input.levels[level];
    if (input.codes.empty()) {
      result.names.push_back(in_quotes(name));
    } else if (name.empty()) {
      result.with_missing = true;
    } else {
      result.names.push_back(literal(input.codes[level]));
    }
  }
  return result;
}

std::string nearest_code(const PlainWords& words, const std::string& x, const std::vector<double>& codes) {
  std::string text = literal(codes.back());
  for (std::size_t k = codes.size() - 1; k-- > 0;)
    text = words.choice(words.at_most(x, literal(0.5 * (codes[k] + codes[k + 1])), false), literal(codes[k]), text);
  return text;
}

std::string literal(double value) {
  const std::string shown = decimal(value);
  double read = 0.0;
  std::from_chars(shown.data(), shown.data() + shown.size(), read);
  return std::abs(read - value) <= 1e-13 * std::abs(value) ? shown : fmt::format("{}", value);
}

std::unique_ptr<PlainWords> plain_words(PlainLanguage language, const std::string& name) {
  switch (language) {
    case PlainLanguage::c:
      return c_words(name);
    case PlainLanguage::python:
      return python_words(name);
    case PlainLanguage::sql:
      break;
  }
  return sql_words(name);
}

}  // namespace llmt::report
