/// \file
/// C source that is made of a model, and the names that it may use.
#pragma once

#include <string>
#include <string_view>

namespace llmt {

/// A C source file and the header that declares its functions.
struct CSource {
  std::string source;  ///< text of the file .c
  std::string header;  ///< text of the file .h
};

/// True if the text means something in every source of C that includes math.h: a keyword, `main`, a macro of math.h as
/// INFINITY and M_PI, in whatever C library, or a macro of compilers as `linux`. No argument can have such a name.
bool is_c_word(std::string_view text);

/// True if the text is an identifier of C of at most 31 characters, and no is_c_word().
bool is_c_identifier(std::string_view text);

}  // namespace llmt
