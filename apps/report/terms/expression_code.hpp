/// \file
/// Expressions of muParser's language in other languages, and names that all of these languages accept.
#pragma once

#include <string>
#include <vector>

namespace llmt::report {

enum class CodeLanguage { c, python };

/// The expression in C (functions of math.h, and `llmt_sign`) or Python (on numbers and arrays of numpy, as `np`), with
/// the same value. Every word that is no function is a variable and stays as it is, except `pi` where it is none of
/// `variables`. Throws std::runtime_error for operators, functions and constants that have no counterpart.
std::string translated(const std::string& expression, const std::vector<std::string>& variables, CodeLanguage language);

/// A word for each name, in order: the name itself where it is a word of at most 100 letters, digits and _ that means
/// nothing else in C, Python or muParser; else one made of it. All are different.
std::vector<std::string> words_for(const std::vector<std::string>& names);

}  // namespace llmt::report
