#include "report/terms/expression_code.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>

#include "llmt/c_code.hpp"

namespace llmt::report {
namespace {

struct Function {
  const char* c;
  const char* python;
  int arguments;
};

const std::map<std::string, Function>& functions() {
  static const std::map<std::string, Function> all = {
      {"sin", {"sin", "np.sin", 1}},         {"cos", {"cos", "np.cos", 1}},
      {"tan", {"tan", "np.tan", 1}},         {"asin", {"asin", "np.arcsin", 1}},
      {"acos", {"acos", "np.arccos", 1}},    {"atan", {"atan", "np.arctan", 1}},
      {"sinh", {"sinh", "np.sinh", 1}},      {"cosh", {"cosh", "np.cosh", 1}},
      {"tanh", {"tanh", "np.tanh", 1}},      {"asinh", {"asinh", "np.arcsinh", 1}},
      {"acosh", {"acosh", "np.arccosh", 1}}, {"atanh", {"atanh", "np.arctanh", 1}},
      {"exp", {"exp", "np.exp", 1}},         {"ln", {"log", "np.log", 1}},
      {"log2", {"log2", "np.log2", 1}},      {"log10", {"log10", "np.log10", 1}},
      {"sqrt", {"sqrt", "np.sqrt", 1}},      {"abs", {"fabs", "np.abs", 1}},
      {"sign", {"llmt_sign", "np.sign", 1}}, {"atan2", {"atan2", "np.arctan2", 2}},
      {"min", {"fmin", "np.minimum", 2}},    {"max", {"fmax", "np.maximum", 2}}};
  return all;
}

bool begins_word(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool is_of_word(char c) { return begins_word(c) || std::isdigit(static_cast<unsigned char>(c)) != 0; }

// Translated text, and how tightly its outermost operator binds.
struct Piece {
  enum Level { condition, sum, product, sign, atom };
  std::string text;
  Level level = atom;

  std::string at(Level least) const { return level < least ? "(" + text + ")" : text; }
};

// Reads by falling level: comparisons, sums, products, signs, powers (which bind tighter than a sign before them).
class Translation {
 public:
  Translation(const std::string& text, const std::vector<std::string>& variables, CodeLanguage language)
      : text_(text), variables_(variables), is_c_(language == CodeLanguage::c) {}

  std::string whole() {
    const Piece piece = comparison();
    if (next() != '\0') refuse(fmt::format("\"{}\"", text_.substr(at_)));
    return piece.text;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw std::runtime_error(fmt::format("{} in \"{}\" has no counterpart in {}", what, text_, is_c_ ? "C" : "Python"));
  }
  char next() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool takes(const std::string& token) {
    next();
    if (text_.compare(at_, token.size(), token) != 0) return false;
    at_ += token.size();
    return true;
  }

  Piece comparison() {
    Piece left = sum();
    for (const char* sign : {"<=", ">=", "==", "!=", "<", ">"}) {
      if (!takes(sign)) continue;
      const std::string condition = left.at(Piece::sum) + " " + sign + " " + sum().at(Piece::sum);
      return is_c_ ? Piece{condition + " ? 1.0 : 0.0", Piece::condition}
                   : Piece{"np.where(" + condition + ", 1.0, 0.0)", Piece::atom};
    }
    return left;
  }
  Piece sum() {
    Piece left = product();
    while (next() == '+' || next() == '-') {
      const char sign = text_[at_++];
      left = {left.at(Piece::sum) + " " + sign + " " + product().at(Piece::product), Piece::sum};
    }
    return left;
  }
  Piece product() {
    Piece left = signed_power();
    while (next() == '*' || next() == '/') {
      const char sign = text_[at_++];
      left = {left.at(Piece::product) + " " + sign + " " + signed_power().at(Piece::sign), Piece::product};
    }
    return left;
  }
  Piece signed_power() {
    if (takes("+")) return signed_power();
    if (takes("-")) return {"-" + signed_power().at(Piece::atom), Piece::sign};
    const Piece base = operand();
    if (!takes("^")) return base;
    const Piece exponent = signed_power();
    return is_c_ ? Piece{"pow(" + base.text + ", " + exponent.text + ")", Piece::atom}
                 : Piece{"(" + base.at(Piece::atom) + " ** " + exponent.at(Piece::atom) + ")", Piece::atom};
  }
  Piece operand() {
    if (takes("(")) {
      Piece inner = comparison();
      if (!takes(")")) refuse(fmt::format("\"{}\"", text_.substr(at_)));
      return {"(" + inner.text + ")", Piece::atom};
    }
    const char first = next();
    if (std::isdigit(static_cast<unsigned char>(first)) != 0 || first == '.') return number();
    if (!begins_word(first)) refuse(at_ < text_.size() ? fmt::format("\"{}\"", text_.substr(at_)) : "the end");
    const std::size_t begin = at_;
    while (at_ < text_.size() && is_of_word(text_[at_])) ++at_;
    const std::string word = text_.substr(begin, at_ - begin);
    if (takes("(")) return call(word);
    if (std::ranges::find(variables_, word) != variables_.end()) return {word, Piece::atom};
    if (word == "pi") return {fmt::format("{}", std::numbers::pi), Piece::atom};
    refuse(fmt::format("\"{}\"", word));
  }
  Piece number() {
    const std::size_t begin = at_;
    const auto digits = [&] {
      while (at_ < text_.size() && std::isdigit(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
    };
    digits();
    if (at_ < text_.size() && text_[at_] == '.') ++at_;
    digits();
    if (at_ < text_.size() && (text_[at_] == 'e' || text_[at_] == 'E')) {
      ++at_;
      if (at_ < text_.size() && (text_[at_] == '-' || text_[at_] == '+')) ++at_;
      digits();
    }
    std::string digits_read = text_.substr(begin, at_ - begin);
    // Whole numbers would be divided as such.
    if (digits_read.find_first_of(".eE") == std::string::npos) digits_read += ".0";
    return {digits_read, Piece::atom};
  }
  Piece call(const std::string& name) {
    const auto known = functions().find(name);
    if (known == functions().end()) refuse(name + "()");
    std::vector<std::string> arguments;
    do {
      arguments.push_back(comparison().text);
    } while (takes(","));
    if (!takes(")")) refuse(fmt::format("\"{}\"", text_.substr(at_)));
    if (std::ssize(arguments) != known->second.arguments) {
      refuse(fmt::format("{}() of {} arguments", name, arguments.size()));
    }
    return {fmt::format("{}({})", is_c_ ? known->second.c : known->second.python, fmt::join(arguments, ", ")),
            Piece::atom};
  }

  const std::string& text_;
  const std::vector<std::string>& variables_;
  bool is_c_;
  std::size_t at_ = 0;
};

// Words that mean something in C, Python, muParser or the code that is written.
bool is_reserved(const std::string& word) {
  static const std::set<std::string> words = {
      "and",     "as",    "assert",    "async",  "await", "class", "def",    "del",       "elif",     "except", "False",
      "finally", "from",  "global",    "import", "in",    "is",    "lambda", "None",      "nonlocal", "not",    "or",
      "pass",    "raise", "True",      "try",    "with",  "yield", "np",     "pow",       "fabs",     "fmin",   "fmax",
      "log",     "pi",    "llmt_sign", "sum",    "avg",   "rint",  "change", "correction"};
  return words.contains(word) || is_c_word(word) || functions().contains(word);
}

// The longest name that muParser reads.
constexpr std::size_t most_letters_of_word = 100;

std::string with_ending(const std::string& word, const std::string& ending) {
  return word.substr(0, most_letters_of_word - ending.size()) + ending;
}

}  // namespace

std::string translated(const std::string& expression, const std::vector<std::string>& variables,
                       CodeLanguage language) {
  return Translation(expression, variables, language).whole();
}

std::vector<std::string> words_for(const std::vector<std::string>& names) {
  std::vector<std::string> words;
  for (const std::string& name : names) {
    std::string word;
    for (const char c : name) word += is_of_word(c) ? c : '_';
    if (word.empty() || !begins_word(word.front()) || word.front() == '_') word = "x" + word;
    if (is_reserved(word)) word += "_";
    std::string different = with_ending(word, "");
    const auto is_taken = [&](const std::string& text) {
      return std::ranges::find(words, text) != words.end() ||
             (text != name && std::ranges::find(names, text) != names.end());
    };
    for (int k = 2; is_taken(different); ++k) different = with_ending(word, fmt::format("_{}", k));
    words.push_back(different);
  }
  return words;
}

}  // namespace llmt::report
