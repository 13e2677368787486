// Words that a name in C must not be.
#include <algorithm>
#include <array>
#include <string_view>

#include "llmt/c_code.hpp"

namespace llmt {
namespace {

// Keywords of C90 to C23 without those that begin with an underscore, and of the dialect that gcc and clang take unless
// they are told otherwise.
constexpr std::array<std::string_view, 48> c_keywords = {
    "alignas",       "alignof",       "asm",      "auto",     "bool",         "break",  "case",    "char",
    "const",         "constexpr",     "continue", "default",  "do",           "double", "else",    "enum",
    "extern",        "false",         "float",    "for",      "goto",         "if",     "inline",  "int",
    "long",          "nullptr",       "register", "restrict", "return",       "short",  "signed",  "sizeof",
    "static",        "static_assert", "struct",   "switch",   "thread_local", "true",   "typedef", "typeof",
    "typeof_unqual", "union",         "unsigned", "void",     "volatile",     "while",  "main",    "NULL"};

// Macros of math.h that have no pattern, in the C standards, POSIX, the C libraries of GNU, BSD and Microsoft; and
// macros that compilers define by themselves.
constexpr std::array<std::string_view, 37> c_macros = {
    "INFINITY",    "NAN",          "MAXFLOAT",       "HUGE",
    "DOMAIN",      "SING",         "OVERFLOW",       "UNDERFLOW",
    "PLOSS",       "TLOSS",        "X_TLOSS",        "EDOM",
    "ERANGE",      "DEC_INFINITY", "DEC_NAN",        "math_errhandling",
    "signgam",     "isnan",        "isinf",          "isfinite",
    "isnormal",    "signbit",      "fpclassify",     "isgreater",
    "isless",      "islessequal",  "isgreaterequal", "islessgreater",
    "isunordered", "issignaling",  "issubnormal",    "iszero",
    "iseqsig",     "iscanonical",  "linux",          "unix",
    "i386"};

// The numbers of math.h, before the suffix of a type: M_PI, M_PIf, M_PIf32x, M_PIl.
constexpr std::array<std::string_view, 27> c_numbers = {
    "M_E",      "M_LOG2E",    "M_LOG10E",   "M_LN2",    "M_LN10",    "M_PI",     "M_PI_2",    "M_PI_4",  "M_1_PI",
    "M_2_PI",   "M_1_SQRTPI", "M_2_SQRTPI", "M_SQRT2",  "M_SQRT1_2", "M_SQRT3",  "M_1_SQRT3", "M_TWOPI", "M_3PI_4",
    "M_SQRTPI", "M_LN2LO",    "M_LN2HI",    "M_IVLN10", "M_LOG2_E",  "M_INVLN2", "M_EGAMMA",  "M_PHI",   "M_TAU"};

bool is_of_macro(char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; }

// Names that the standard keeps for math.h.
bool is_kept_for_math(std::string_view text) {
  constexpr std::array<std::string_view, 4> beginnings = {"FP_", "MATH_", "HUGE_VAL", "SNAN"};
  return std::ranges::all_of(text, is_of_macro) &&
         std::ranges::any_of(beginnings, [&](std::string_view begin) { return text.starts_with(begin); });
}

std::string_view without_type(std::string_view text) {
  if (text.ends_with('l')) return text.substr(0, text.size() - 1);
  const std::size_t last = text.find_last_of('f');
  if (last == std::string_view::npos) return text;
  const std::string_view type = text.substr(last + 1);
  const bool is_type = std::ranges::all_of(type, [](char c) { return (c >= '0' && c <= '9') || c == 'x'; });
  return is_type ? text.substr(0, last) : text;
}

template <class List>
bool lists_word(const List& list, std::string_view text) {
  return std::ranges::find(list, text) != list.end();
}

}  // namespace

bool is_c_word(std::string_view text) {
  return lists_word(c_keywords, text) || lists_word(c_macros, text) || lists_word(c_numbers, without_type(text)) ||
         is_kept_for_math(text);
}

}  // namespace llmt
