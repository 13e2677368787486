/// \file
/// Reading and writing of whole files.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace llmt {

/// The bytes of a file. Throws std::runtime_error `path: cannot be read: reason`.
std::string read_file(const std::string& path);

/// Makes `content` the content of the file at `path`: written to a temporary file beside it, which is then renamed. If
/// anything fails (no such folder, no permission, disk full) the old file stays as it was, nothing is left behind, and
/// std::runtime_error `path: cannot be written: reason` is thrown. What is there and is not a regular file
/// (/dev/stdout, a pipe) is written to directly.
void write_file(const std::string& path, std::string_view content);

/// Takes the next piece of a text.
using TextSink = std::function<void(std::string_view)>;

/// As above, for content that need not be in memory as a whole: `produce` passes it on piece by piece. What `produce`
/// throws is thrown, and the old file stays.
void write_file(const std::string& path, const std::function<void(const TextSink&)>& produce);

}  // namespace llmt
