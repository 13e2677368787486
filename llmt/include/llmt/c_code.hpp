/// \file
/// Text of a program in C, and the names that it may have.
#pragma once

#include <string>
#include <string_view>

namespace llmt {

/// A source and its header.
struct CSource {
  std::string source;
  std::string header;
};

/// Whether a text is an identifier of C of at most 31 characters, and no keyword.
bool is_c_identifier(std::string_view text);

}  // namespace llmt
