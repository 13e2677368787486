/// \file
/// Expressions of named numbers, as users write them into files. Robot descriptions, catalogues and files of terms all
/// read them here.
///
///     llmt::Expression power("0.5 * rho * v^2", {{"rho", 1.2}});   // power.names() is {"v"}
///     const double value = power.value(std::vector<double>{3.0});  // 5.4
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace llmt {

/// An expression that cannot be accepted. The message has the column and the text.
class ExpressionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One expression, for example `2 * sin(x) + (y > 0 ? 1 : 0)`, in the language of muParser without its assignments: an
/// expression changes no variable. It has one value.
class Expression {
 public:
  static constexpr std::size_t longest = 10000;  ///< characters

  /// `constants`: names that stand for a number. Every other name that is no function is a variable. Throws
  /// ExpressionError for what cannot be read, has no or several values, holds `=`, or is longer than `longest`.
  explicit Expression(const std::string& text, const std::map<std::string, double>& constants = {});
  ~Expression();
  Expression(Expression&&) noexcept;
  Expression& operator=(Expression&&) noexcept;

  /// The variables, ascending.
  const std::vector<std::string>& names() const;

  /// The value for one number per variable, in the order of names(). Not finite where the expression is not, as 1/0.
  /// One thread at a time.
  double value(std::span<const double> variables);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace llmt
