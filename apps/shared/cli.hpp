/// \file
/// The habits that both programs share: exit codes, errors, tables and JSON on stdout, everything else on stderr.
#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>
#include <string_view>

#include "llmt/finding.hpp"
#include "report/text/json.hpp"
#include "report/text/not_evaluated.hpp"
#include "report/text/text.hpp"
#include "shared/progress.hpp"

namespace llmt::apps {

using report::finite_or_null;
using report::Json;
using report::number;
using report::Table;

/// Exit codes: done, or good; the data or the outcome does not allow it, or no longer good; wrong usage; changed, but
/// within limits; not evaluated (report::NotEvaluated).
inline constexpr int exit_done = 0;
inline constexpr int exit_refused = 1;
inline constexpr int exit_usage = 2;
inline constexpr int exit_changed = 3;
inline constexpr int exit_not_evaluated = 4;

/// Thrown by a command that has said everything, to end with this exit code.
struct ExitCode {
  int code = exit_done;
};

/// How the library's name of a setting is written on the command line: "folds.count", "--cv".
struct SettingName {
  std::string_view setting;
  std::string_view option;
};

/// The message of an error as a user of the program knows the words: without the C++ function that it begins with, and
/// with options in place of the settings that it names.
std::string in_words_of_user(std::string_view message, std::span<const SettingName> names);

/// Adds --version, parses the command line, runs the callbacks of the subcommands and turns what they throw into a
/// message on stderr and an exit code: std::invalid_argument (an option that the library cannot accept) is wrong usage,
/// report::NotEvaluated has a code of its own, every other exception is a refusal. An ExitCode is that code. `names`:
/// for in_words_of_user(). SIGINT, SIGTERM and SIGHUP end the program without leaving a temporary file; a file that may
/// not grow further (SIGXFSZ) is a failed write.
int run(CLI::App& app, int argc, char** argv, std::span<const SettingName> names = {});

/// The text with control characters but tabs and line breaks, marks of direction and bytes that are never UTF-8 written
/// as \x1b: names that come from files cannot give orders to a terminal, or exchange the order of letters on it.
std::string without_controls(std::string_view text);

/// Columns of the terminal that stdout is: those of the terminal, or COLUMNS if it is set; at least 40. No limit where
/// stdout is no terminal.
std::size_t output_width();

/// Prints text for people to stdout, without_controls() and wrapped() to the terminal's width, and reports a stdout
/// that cannot take it (a full disk, a closed pipe) as std::runtime_error.
void print(std::string_view text);
/// Prints data for programs: as it is, but on a terminal as print().
void print_bytes(std::string_view text);
/// While one lives, nothing is printed to stdout and nothing is warned of: for a command that runs others.
class Silence {
 public:
  Silence();
  ~Silence();
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;
};

/// Bytes that are not UTF-8 become U+FFFD.
void print_json(const Json& json);

/// A line on stderr, without_controls() and with line breaks as \x0a. Of a long text (a message may quote what it
/// refuses) the middle is left out.
void warn(const std::string& text);

/// warn() in the words of a program, after "WARNING: " if results are probably wrong.
void warn_of(const Finding& finding);

}  // namespace llmt::apps
