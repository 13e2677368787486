/// \file
/// Standard error as it may be: closed, on a full disk, a pipe that nobody reads. A message that cannot be written is
/// lost and changes nothing else.
#pragma once

#include <string_view>

namespace llmt::apps {

/// Writes to standard error at once. A failure is ignored, and no signal comes of it.
void write_stderr(std::string_view text);

/// Puts a device in the place of standard input, output and error where they are closed: a file that the program opens
/// would get their number otherwise, and messages would be written into it. Reading and writing of the first two fail
/// as before.
void occupy_closed_standard_files();

}  // namespace llmt::apps
