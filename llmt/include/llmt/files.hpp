/// \file
/// Reading and writing of whole files.
///
///     llmt::write_file("result.txt", llmt::read_file("notes.txt"));  // appears whole or not at all
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "llmt/limits.hpp"

namespace llmt {

/// How much read_file() takes. What never ends (a pipe, /dev/zero) is refused there, before memory ends.
struct FileLimit {
  std::uintmax_t bytes = std::uintmax_t{1} << 30;                          ///< of the file: 1 GiB
  std::uintmax_t line_bytes = std::numeric_limits<std::uintmax_t>::max();  ///< of a line: no limit of its own
};

/// The limit for a file that people write, such as a robot description, a catalogue or terms: 16 MiB.
inline constexpr FileLimit description_limit{.bytes = most(Limit::description_bytes)};

/// The limit for a model: 256 MiB. A leaf of 1000 inputs takes 13 MB.
inline constexpr FileLimit model_limit{.bytes = most(Limit::model_bytes)};

/// The bytes of a file. Throws std::runtime_error `path: cannot be read: reason`, also beyond the limit.
std::string read_file(const std::string& path, const FileLimit& limit = {});

/// Makes `content` the content of the file at `path`. It is written to a file that has no name, or where the file
/// system cannot do that to one whose name nobody can foresee, in the same folder. Once it is on the disk it takes the
/// name. If a step fails (no such folder, no permission, disk full) the old file stays as it was, nothing is left
/// behind, and std::runtime_error `path: cannot be written: reason` is thrown. The one exception is the last step,
/// which makes the name durable: if it fails, the new file is there, and the error says so.
///
/// The permissions of the old file stay; a new file gets what the umask leaves of 0666. A link stays a link: the file
/// it points to is replaced, or made. What is there and is not a regular file (/dev/stdout, a pipe) is written to
/// directly.
void write_file(const std::string& path, std::string_view content);

struct NewFile {
  std::string path;
  std::string content;
};

/// The same for files that belong together. All of them are on the disk before the first one takes its name, so that a
/// full disk changes none.
void write_files(std::span<const NewFile> files);

/// Takes the next piece of a text.
using TextSink = std::function<void(std::string_view)>;

/// As above, for content that need not be in memory as a whole: `produce` passes it on piece by piece. What `produce`
/// throws is thrown, and the old file stays.
void write_file(const std::string& path, const std::function<void(const TextSink&)>& produce);

/// Removes the named temporary files of all running write_file(). For the signal handler of a program, just before the
/// program ends: it may be called there, and a write_file() that goes on all the same fails. The library installs no
/// handler itself.
void discard_unfinished_files() noexcept;

}  // namespace llmt
