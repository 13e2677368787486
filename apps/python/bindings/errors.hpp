/// \file
/// What the libraries say, in the words of Python.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "llmt/files.hpp"

namespace llmt::python {

/// Without the C++ functions that messages name; `same_session` in place of the option --same-session; and of a
/// table that was given in memory, whose name is "<measured>", `measured, row 5` in place of the line 7. Rows are
/// counted from 0.
std::string in_words_of_python(std::string_view message);

/// Exceptions of the libraries become ValueError, and InterruptedError where a callback cancelled the work.
void register_errors();

/// write_files(), whose failure is Python's OSError.
void write_or_raise(std::span<const NewFile> files);

}  // namespace llmt::python
