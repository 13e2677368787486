/// \file
/// How C, Python and SQL say what the rules of a tree are made of.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "llmt/partition.hpp"
#include "report/model/plain_source.hpp"

namespace llmt::report {

/// The number as it is read back; without rounding errors in its last digits where that is shorter.
std::string literal(double value);

/// An argument of a function.
struct PlainArgument {
  std::string name;
  std::string column;  ///< of the table
  bool is_text = false;
};

/// A variable and what it is.
struct PlainDefinition {
  std::string name;
  std::string expression;
};

/// Expressions and statements of a language. Conditions are never unknown: a missing value has an answer.
class PlainWords {
 public:
  virtual ~PlainWords() = default;

  virtual std::string identifier(const std::string& wish) const = 0;
  virtual std::set<std::string> reserved() const = 0;
  /// How a column is named that is no argument of a function; empty: all are arguments.
  virtual std::string column(const std::string& name) const = 0;
  /// The value as the expressions below take it; `x` itself where that is it.
  virtual std::string known(const std::string& x, const InputColumn& input) const = 0;
  virtual std::string held(const std::string& x, double low, double high, double mean) const = 0;
  virtual std::string or_mean(const std::string& x, double mean) const = 0;
  virtual std::string choice(const std::string& condition, const std::string& yes, const std::string& no) const = 0;
  virtual std::string among(const std::string& x, const InputColumn& input, const std::vector<int>& levels) const = 0;
  virtual std::string is_known(const std::string& x) const = 0;
  virtual std::string at_most(const std::string& x, const std::string& bound, bool missing_too) const = 0;
  virtual std::string negated(const std::string& condition) const = 0;

  virtual std::string head(const std::string& model_name) const = 0;
  virtual std::string if_open(const std::string& condition, int depth) const = 0;
  virtual std::string if_else(int depth) const = 0;
  virtual std::string if_close(int depth) const = 0;
  virtual std::string result(const std::string& equation, int depth) const = 0;
  /// `rules`: of if_open() and the like.
  virtual std::string function(const std::string& target, bool is_last, const std::vector<PlainArgument>& arguments,
                               const std::vector<PlainDefinition>& definitions, const std::string& rules) = 0;
};

/// `name`: begins all names; in SQL the table.
std::unique_ptr<PlainWords> plain_words(PlainLanguage language, const std::string& name);

}  // namespace llmt::report
