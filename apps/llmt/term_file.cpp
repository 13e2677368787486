#include "llmt/term_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <muParser.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "llmt/files.hpp"

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

// An expression with the variables it reads; the parser holds pointers into them.
struct Expression {
  std::vector<double> variables;  // inputs, then the simulated output
  mu::Parser parser;
};

std::shared_ptr<Expression> compiled(const std::string& text, const discovery::Inputs& inputs,
                                     const std::string& output) {
  auto expression = std::make_shared<Expression>();
  expression->variables.resize(inputs.names.size() + 1);
  std::vector<std::string> known;
  const auto define = [&](const std::string& name, std::size_t place) {
    if (!is_word(name)) return;
    expression->parser.DefineVar(name, &expression->variables[place]);
    known.push_back(name);
  };
  for (std::size_t j = 0; j < inputs.names.size(); ++j) define(inputs.names[j], j);
  if (std::ranges::find(known, output) == known.end()) define(output, inputs.names.size());
  if (std::ranges::find(known, "pi") == known.end()) expression->parser.DefineConst("pi", std::numbers::pi);
  expression->parser.SetExpr(text);
  for (const auto& [name, value] : expression->parser.GetUsedVar()) {
    if (std::ranges::find(known, name) == known.end()) {
      throw std::runtime_error(fmt::format("\"{}\" is not an input; there are {}", name, fmt::join(known, ", ")));
    }
  }
  expression->parser.Eval();
  return expression;
}

discovery::ModelTerm term_of(const std::string& name, const std::string& text, const discovery::Inputs& inputs,
                             const std::string& output) {
  const std::shared_ptr<Expression> expression = compiled(text, inputs, output);
  discovery::ModelTerm term;
  term.family = name;
  term.formula = text;
  for (const auto& [used, value] : expression->parser.GetUsedVar()) {
    if (used != output || output.empty()) term.inputs.push_back(used);
  }
  term.coefficients = {"coefficient"};
  term.per = "(" + text + ")";
  term.columns = [expression](const discovery::Rows& rows, const Eigen::VectorXd&) {
    Eigen::MatrixXd column(rows.inputs.rows(), 1);
    for (Eigen::Index i = 0; i < column.rows(); ++i) {
      for (Eigen::Index j = 0; j < rows.inputs.cols(); ++j) {
        expression->variables[j] = rows.inputs(i, j);
      }
      expression->variables.back() = rows.simulated(i);
      column(i, 0) = expression->parser.Eval();
    }
    return column;
  };
  return term;
}

}  // namespace

std::vector<discovery::ModelTerm> read_terms(const std::string& path, const discovery::Inputs& inputs,
                                             const std::string& output, const discovery::Rows& rows,
                                             const std::vector<std::string>& taken) {
  std::vector<discovery::ModelTerm> terms;
  std::istringstream text(read_file(path, description_limit));
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    const auto refuse = [&](const std::string& reason) {
      throw std::runtime_error(fmt::format("{}:{}: {}", path, number, reason));
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
    } catch (const mu::Parser::exception_type& error) {
      refuse(fmt::format("{}: column {} of \"{}\": {}", name, error.GetPos() + 1, expression, error.GetMsg()));
    } catch (const std::runtime_error& error) {
      refuse(fmt::format("{}: {}", name, error.what()));
    }
    const Eigen::MatrixXd values = terms.back().columns(rows, {});
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      if (!std::isfinite(values(i, 0))) {
        refuse(fmt::format("{}: \"{}\" is not a finite number at data row {}", name, expression, i + 1));
      }
    }
  }
  return terms;
}

}  // namespace llmt::apps
