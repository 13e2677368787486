// C and Python as plain_source() writes them.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "llmt/c_code.hpp"
#include "report/model/plain_text.hpp"

namespace llmt::report {
namespace {

// In the double quotes of C and Python; what is no printable ASCII letter in octal digits.
std::string in_quotes(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\' || c == '?' || code < ' ' || code == 127) {
      quoted += fmt::format("\\{:03o}", code);
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

// C and Python, whose NaN is below nothing.
class Program : public PlainWords {
 public:
  explicit Program(std::string name) : name_(std::move(name)) {}

  std::string column(const std::string&) const override { return ""; }
  std::string held(const std::string& x, double low, double high, double mean) const override {
    return fmt::format("{}_held({}, {}, {}, {})", name_, x, literal(low), literal(high), literal(mean));
  }

 protected:
  std::string name_;
};

class CWords : public Program {
 public:
  using Program::Program;

  std::string identifier(const std::string& wish) const override {
    const std::string text = plain_letters(wish);
    return is_c_word(text) || text.starts_with("_") ? "x" + text : text;
  }
  std::set<std::string> reserved() const override { return {name_ + "_held", name_ + "_is", "isnan", "strcmp"}; }
  std::string known(const std::string& x, const InputColumn& input) const override {
    if (input.codes.empty()) return x;
    return choice(fmt::format("isnan({})", x), x, nearest_code(*this, x, input.codes));
  }
  std::string or_mean(const std::string& x, double mean) const override {
    return choice(fmt::format("isnan({})", x), literal(mean), x);
  }
  std::string choice(const std::string& condition, const std::string& yes, const std::string& no) const override {
    return fmt::format("{} ? {} : {}", condition, yes, no);
  }
  std::string among(const std::string& x, const InputColumn& input, const std::vector<int>& levels) const override {
    std::vector<std::string> parts;
    for (const int level : levels) {
      const std::string& name = input.levels[level];
      if (input.codes.empty()) {
        parts.push_back(fmt::format("{}_is({}, {})", name_, x, in_quotes(name)));
      } else {
        parts.push_back(name.empty() ? fmt::format("isnan({})", x)
                                     : fmt::format("{} == {}", x, literal(input.codes[level])));
      }
    }
    if (parts.empty()) return "0";
    return parts.size() == 1 ? parts[0] : fmt::format("({})", fmt::join(parts, " || "));
  }
  std::string is_known(const std::string& x) const override { return fmt::format("!isnan({})", x); }
  std::string at_most(const std::string& x, const std::string& bound, bool missing_too) const override {
    return missing_too ? fmt::format("!({} > {})", x, bound) : fmt::format("{} <= {}", x, bound);
  }
  std::string negated(const std::string& condition) const override { return fmt::format("!({})", condition); }

  std::string head(const std::string& model_name) const override {
    return fmt::format(R"(/* The rules of {}, written by llmt: one function for each target.
   NAN is a missing number, NULL a missing text. */
#include <math.h>
#include <stddef.h>
#include <string.h>

/* x between low and high; beyond, it is held there, rounded off over a tenth of the range. Missing: the mean. */
static double {}_held(double x, double low, double high, double mean) {{
  double beyond = x > high ? x - high : low - x;
  double round = 0.1 * (high - low);
  double step;
  if (isnan(x)) return mean;
  if (beyond <= 0.0) return x;
  step = beyond < round ? beyond - 0.5 * beyond * beyond / round : 0.5 * round;
  return x > high ? high + step : low - step;
}}

static int {}_is(const char *text, const char *level) {{ return strcmp(text == NULL ? "" : text, level) == 0; }}
)",
                       in_comment(model_name), name_, name_);
  }
  std::string if_open(const std::string& condition, int depth) const override {
    return fmt::format("{}if ({}) {{\n", spaces(depth), condition);
  }
  std::string if_else(int depth) const override { return spaces(depth) + "} else {\n"; }
  std::string if_close(int depth) const override { return spaces(depth) + "}\n"; }
  std::string result(const std::string& equation, int depth) const override {
    return fmt::format("{}return {};\n", spaces(depth), wrapped_equation(equation, spaces(depth) + "       "));
  }
  std::string function(const std::string& target, bool, const std::vector<PlainArgument>& arguments,
                       const std::vector<PlainDefinition>& definitions, const std::string& rules) override {
    std::vector<std::string> parameters;
    for (const PlainArgument& argument : arguments)
      parameters.push_back((argument.is_text ? "const char *" : "double ") + argument.name);
    std::string text =
        fmt::format("\n/* {} */\ndouble {}_{}({}) {{\n", in_comment(target), name_, plain_letters(target),
                    parameters.empty() ? "void" : fmt::format("{}", fmt::join(parameters, ", ")));
    for (const PlainDefinition& each : definitions) {
      const bool is_argument = std::ranges::find(arguments, each.name, &PlainArgument::name) != arguments.end();
      text += fmt::format("  {}{} = {};\n", is_argument ? "" : "double ", each.name, each.expression);
    }
    return text + rules + "}\n";
  }
};

class PythonWords : public Program {
 public:
  using Program::Program;

  std::string identifier(const std::string& wish) const override {
    static const std::set<std::string> words = {
        "False",   "None",     "True",  "and",    "as",   "assert", "async",  "await",    "break",
        "class",   "continue", "def",   "del",    "elif", "else",   "except", "for",      "from",
        "finally", "global",   "if",    "import", "in",   "is",     "lambda", "nonlocal", "not",
        "or",      "pass",     "raise", "return", "try",  "while",  "with",   "yield",    "float"};
    const std::string text = plain_letters(wish);
    return words.contains(text) || text.starts_with("_") ? "x" + text : text;
  }
  std::set<std::string> reserved() const override { return {name_ + "_held", name_ + "_number"}; }
  std::string known(const std::string& x, const InputColumn& input) const override {
    if (input.is_categorical() && input.codes.empty()) return x + " or \"\"";
    const std::string number = fmt::format("{}_number({})", name_, x);
    if (input.codes.empty()) return number;
    return choice(fmt::format("{0} != {0}", number), number, nearest_code(*this, x, input.codes));
  }
  std::string or_mean(const std::string& x, double mean) const override {
    return choice(fmt::format("{0} != {0}", x), literal(mean), x);
  }
  std::string choice(const std::string& condition, const std::string& yes, const std::string& no) const override {
    return fmt::format("{} if {} else {}", yes, condition, no);
  }
  std::string among(const std::string& x, const InputColumn& input, const std::vector<int>& levels) const override {
    const auto [named, with_missing] = named_levels(input, levels, in_quotes);
    std::string text = named.size() == 1 ? fmt::format("{} == {}", x, named[0])
                       : named.empty()   ? "False"
                                         : fmt::format("{} in ({})", x, fmt::join(named, ", "));
    if (with_missing) text = fmt::format("({0} or {1} != {1})", text, x);
    return text;
  }
  std::string is_known(const std::string& x) const override { return fmt::format("{0} == {0}", x); }
  std::string at_most(const std::string& x, const std::string& bound, bool missing_too) const override {
    return missing_too ? fmt::format("not {} > {}", x, bound) : fmt::format("{} <= {}", x, bound);
  }
  std::string negated(const std::string& condition) const override { return fmt::format("not ({})", condition); }

  std::string head(const std::string& model_name) const override {
    return fmt::format(R"(# The rules of {0}, written by llmt: one function for each target.
# None and NaN are missing values.


def {1}_held(x, low, high, mean):
    """x between low and high; beyond, held there, rounded off over a tenth of the range. Missing: the mean."""
    if x != x:
        return mean
    beyond = x - high if x > high else low - x
    if beyond <= 0.0:
        return x
    round_off = 0.1 * (high - low)
    step = beyond - 0.5 * beyond * beyond / round_off if beyond < round_off else 0.5 * round_off
    return high + step if x > high else low - step


def {1}_number(x):
    return float("nan") if x is None else float(x)
)",
                       in_comment(model_name), name_);
  }
  std::string if_open(const std::string& condition, int depth) const override {
    return fmt::format("{}if {}:\n", spaces(2 * depth), condition);
  }
  std::string if_else(int depth) const override { return spaces(2 * depth) + "else:\n"; }
  std::string if_close(int) const override { return ""; }
  std::string result(const std::string& equation, int depth) const override {
    const std::string lines = wrapped_equation(equation, spaces(2 * depth) + "        ");
    const bool is_long = lines.find('\n') != std::string::npos;
    return fmt::format("{}return {}{}{}\n", spaces(2 * depth), is_long ? "(" : "", lines, is_long ? ")" : "");
  }
  std::string function(const std::string& target, bool, const std::vector<PlainArgument>& arguments,
                       const std::vector<PlainDefinition>& definitions, const std::string& rules) override {
    std::vector<std::string> parameters;
    for (const PlainArgument& argument : arguments) parameters.push_back(argument.name);
    std::string text = fmt::format("\n\ndef {}_{}({}):\n", name_, plain_letters(target), fmt::join(parameters, ", "));
    for (const PlainDefinition& each : definitions) text += fmt::format("    {} = {}\n", each.name, each.expression);
    return text + rules;
  }
};

}  // namespace

std::unique_ptr<PlainWords> c_words(const std::string& name) { return std::make_unique<CWords>(name); }

std::unique_ptr<PlainWords> python_words(const std::string& name) { return std::make_unique<PythonWords>(name); }

}  // namespace llmt::report
