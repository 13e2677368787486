#include "trees/term_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "expressions/expression.hpp"
#include "llmt/files.hpp"
#include "llmt/options.hpp"

namespace llmt::apps {
namespace {

constexpr const char* word_letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_0123456789";

bool is_word(const std::string& text) {
  return !text.empty() && text.find_first_not_of(word_letters) == std::string::npos && (text[0] < '0' || text[0] > '9');
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

// What an expression may name.
std::vector<std::string> words_of(const discovery::Inputs& inputs, const std::string& output) {
  std::vector<std::string> words;
  std::ranges::copy_if(inputs.names, std::back_inserter(words), is_word);
  if (is_word(output) && std::ranges::find(words, output) == words.end()) words.push_back(output);
  return words;
}

// An expression and where its variables stand: the number of an input, or the number of inputs for the simulated
// output.
struct Compiled {
  Expression expression;
  std::vector<std::size_t> places = {};
  std::vector<double> variables = {};
};

std::shared_ptr<Compiled> compiled(const std::string& text, const discovery::Inputs& inputs,
                                   const std::string& output) {
  const std::vector<std::string> known = words_of(inputs, output);
  std::map<std::string, double> constants;
  if (std::ranges::find(known, "pi") == known.end()) constants["pi"] = std::numbers::pi;
  auto result = std::make_shared<Compiled>(Compiled{Expression(text, constants)});
  for (const std::string& name : result->expression.names()) {
    if (std::ranges::find(known, name) == known.end()) {
      throw ExpressionError(fmt::format("\"{}\" is not an input; there are {}", name, fmt::join(known, ", ")));
    }
    result->places.push_back(std::ranges::find(inputs.names, name) - inputs.names.begin());
  }
  result->variables.resize(result->places.size());
  return result;
}

discovery::ModelTerm term_of(const std::string& name, const std::string& text, const discovery::Inputs& inputs,
                             const std::string& output) {
  const std::shared_ptr<Compiled> term_code = compiled(text, inputs, output);
  discovery::ModelTerm term;
  term.family = name;
  term.formula = text;
  for (const std::string& used : term_code->expression.names()) {
    if (used != output || output.empty()) term.inputs.push_back(used);
  }
  term.coefficients = {"coefficient"};
  term.per = "(" + text + ")";
  term.code = {text};
  term.columns = [term_code](const discovery::Rows& rows, const Eigen::VectorXd&) {
    Eigen::MatrixXd column(rows.inputs.rows(), 1);
    for (Eigen::Index i = 0; i < column.rows(); ++i) {
      std::ranges::transform(term_code->places, term_code->variables.begin(), [&](Eigen::Index place) {
        return place < rows.inputs.cols() ? rows.inputs(i, place) : rows.simulated(i);
      });
      column(i, 0) = term_code->expression.value(term_code->variables);
    }
    return column;
  };
  return term;
}

}  // namespace

std::vector<discovery::ModelTerm> read_terms(const std::string& path, const discovery::Inputs& inputs,
                                             const std::string& output, const discovery::Rows& rows,
                                             const std::vector<std::string>& taken) {
  return parse_terms(read_file(path, description_limit), path, inputs, output, rows, taken);
}

std::vector<discovery::ModelTerm> parse_terms(const std::string& text, const std::string& file,
                                              const discovery::Inputs& inputs, const std::string& output,
                                              const discovery::Rows& rows, const std::vector<std::string>& taken) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    throw std::runtime_error(fmt::format("{}: this is UTF-16, UTF-8 is needed", file));
  }
  std::vector<discovery::ModelTerm> terms;
  std::istringstream lines(text.substr(text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto refuse = [&](const std::string& reason) {
      throw std::runtime_error(fmt::format("{}:{}: {}", file, number, reason));
    };
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos) refuse("not of the form name = expression");
    const std::string name = trimmed(line.substr(0, equals));
    const std::string expression = trimmed(line.substr(equals + 1));
    if (!is_word(name)) refuse(fmt::format("the name \"{}\" is not a word of letters, digits and _", name));
    if (std::ranges::find(taken, name) != taken.end())
      refuse(fmt::format("\"{}\" is the name of a built-in term", name));
    if (std::ranges::find(terms, name, &discovery::ModelTerm::family) != terms.end()) {
      refuse(fmt::format("the name \"{}\" is there twice", name));
    }
    if (expression.empty()) refuse(fmt::format("{}: no expression after =", name));
    try {
      terms.push_back(term_of(name, expression, inputs, output));
    } catch (const ExpressionError& error) {
      refuse(fmt::format("{}: {}", name, error.what()));
    }
    const Eigen::MatrixXd values = terms.back().columns(rows, {});
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      if (!std::isfinite(values(i, 0))) {
        refuse(fmt::format("{}: \"{}\" is not a finite number at data row {}", name, expression, i + 1));
      }
      if (std::abs(values(i, 0)) > largest_magnitude) {
        refuse(fmt::format("{}: \"{}\" is {} at data row {}, the largest magnitude is {}", name, expression,
                           values(i, 0), i + 1, largest_magnitude));
      }
    }
  }
  return terms;
}

}  // namespace llmt::apps
