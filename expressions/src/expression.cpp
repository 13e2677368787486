#include "expressions/expression.hpp"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>

namespace llmt {
namespace {

// What a message shows of a text that a file holds.
std::string shortened(const std::string& text, std::size_t most = 60) {
  if (text.size() <= most) return text;
  std::size_t end = most;
  while (end > 0 && (text[end] & 0xC0) == 0x80) --end;  // whole characters of UTF-8
  return text.substr(0, end) + "...";
}

[[noreturn]] void refuse(const std::string& text, std::size_t column, const std::string& reason) {
  throw ExpressionError(fmt::format("column {} of \"{}\": {}", column, shortened(text), reason));
}

bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7F'; }

// muParser has an assignment, which it cannot be told to leave out. Operators are the same in all places of an
// expression, for there are no strings in it.
void refuse_characters(const std::string& text) {
  for (std::size_t at = 0; at < text.size(); ++at) {
    const std::string pair = text.substr(at, 2);
    if (pair == "==" || pair == "!=" || pair == "<=" || pair == ">=") {
      ++at;
    } else if (text[at] == '=') {
      refuse(text, at + 1, "== compares; = is not allowed");
    } else if (text[at] == '"') {
      refuse(text, at + 1, "there are no strings in expressions");
    } else if (is_control(text[at]) && text[at] != '\t' && text[at] != '\n' && text[at] != '\r') {
      refuse(text.substr(0, at), at + 1, "a control character");
    }
  }
}

}  // namespace

struct Expression::Parts {
  mu::Parser parser;  // holds pointers into `variables`
  std::vector<std::string> names;
  std::vector<double> variables;
};

Expression::Expression(const std::string& text, const std::map<std::string, double>& constants)
    : parts_(std::make_unique<Parts>()) {
  if (text.size() > longest) {
    throw ExpressionError(
        fmt::format("\"{}\" has {} characters, at most {} are read", shortened(text), text.size(), longest));
  }
  refuse_characters(text);
  mu::Parser& parser = parts_->parser;
  try {
    for (const auto& [name, value] : constants) parser.DefineConst(name, value);
    parser.SetExpr(text);
    for (const auto& [name, variable] : parser.GetUsedVar()) parts_->names.push_back(name);
    parts_->variables.assign(parts_->names.size(), 0.0);
    for (std::size_t k = 0; k < parts_->names.size(); ++k) parser.DefineVar(parts_->names[k], &parts_->variables[k]);
    // Mistakes that only show when it is evaluated, such as a function with too few arguments.
    parser.Eval();
  } catch (const mu::Parser::exception_type& error) {
    refuse(text, std::clamp<std::size_t>(error.GetPos() + 1, 1, text.size() + 1), shortened(error.GetMsg(), 200));
  }
  if (parser.GetNumResults() != 1) refuse(text, 1, "there are several values, separated by commas");
}

Expression::~Expression() = default;
Expression::Expression(Expression&&) noexcept = default;
Expression& Expression::operator=(Expression&&) noexcept = default;

const std::vector<std::string>& Expression::names() const { return parts_->names; }

double Expression::value(std::span<const double> variables) {
  std::ranges::copy(variables.first(parts_->variables.size()), parts_->variables.begin());
  return parts_->parser.Eval();
}

}  // namespace llmt
