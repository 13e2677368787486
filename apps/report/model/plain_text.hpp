/// \file
/// What sources in C, Python and SQL have in common.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "report/model/plain_words.hpp"

namespace llmt::report {

std::string spaces(int depth);

/// Letters, digits and underscores of ASCII, the first one no digit.
std::string plain_letters(const std::string& wish);

/// Lines of an equation, broken before a sign; all but the first begin with `indent`.
std::string wrapped_equation(const std::string& equation, const std::string& indent);

/// Text without what could end a comment, or begin another line.
std::string in_comment(std::string text);

/// The nearest of the codes of a categorical input; of two the smaller.
std::string nearest_code(const PlainWords& words, const std::string& x, const std::vector<double>& codes);

/// Levels of a categorical input as a source names them: words in quotes, codes as numbers. A code has no name where
/// it stands for a missing value.
struct NamedLevels {
  std::vector<std::string> names;
  bool with_missing = false;
};
NamedLevels named_levels(const InputColumn& input, const std::vector<int>& levels,
                         const std::function<std::string(const std::string&)>& in_quotes);

std::unique_ptr<PlainWords> c_words(const std::string& name);
std::unique_ptr<PlainWords> python_words(const std::string& name);
std::unique_ptr<PlainWords> sql_words(const std::string& table);

}  // namespace llmt::report
