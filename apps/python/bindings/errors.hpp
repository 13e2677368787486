/// \file
/// What the libraries say, in the words of Python.
#pragma once

#include <span>

#include "llmt/files.hpp"

namespace llmt::python {

/// Exceptions of the libraries become ValueError, and InterruptedError where a callback cancelled the work. Their
/// messages are without the C++ functions that they name; with `same_session` in place of the option --same-session;
/// and of a table in memory, whose name is "<measured>", with `measured, row 5` in place of line 7. Rows count from 0.
void register_errors();

/// write_files(), whose failure is Python's OSError.
void write_or_raise(std::span<const NewFile> files);

}  // namespace llmt::python
