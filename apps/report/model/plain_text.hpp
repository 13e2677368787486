/// \file
/// What sources in C, Python and SQL have in common.
#pragma once

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

std::unique_ptr<PlainWords> c_words(const std::string& name);
std::unique_ptr<PlainWords> python_words(const std::string& name);
std::unique_ptr<PlainWords> sql_words(const std::string& table);

}  // namespace llmt::report
