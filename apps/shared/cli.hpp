/// \file
/// The habits that both programs share: exit codes, errors, tables and JSON on stdout, everything else on stderr.
#pragma once

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace llmt::apps {

using Json = nlohmann::ordered_json;

/// Exit codes: done; the data or the outcome does not allow it; wrong usage.
inline constexpr int exit_done = 0;
inline constexpr int exit_refused = 1;
inline constexpr int exit_usage = 2;

/// Parses the command line, runs the callbacks of the subcommands and turns what they throw into a message on stderr
/// and an exit code: std::invalid_argument (an option that the library cannot accept) is wrong usage, every other
/// exception a refusal.
int run(CLI::App& app, int argc, char** argv);

/// Rows of text under a header, columns aligned: words to the left, numbers to the right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// A number for people: `digits` significant digits, without an exponent where that is short.
std::string number(double value, int digits = 4);

/// Prints to stdout and reports a stdout that cannot take it (a full disk, a closed pipe) as std::runtime_error.
void print(std::string_view text);
/// What is not UTF-8, such as the name of a file, is replaced by U+FFFD; a number that is not finite is null.
void print_json(const Json& json);

/// A line on stderr.
void warn(const std::string& text);

/// How far a long job is: "fold 3 of 5" on one line of stderr, rewritten in place, only where stderr is a terminal.
class Progress {
 public:
  explicit Progress(std::string what) : what_(std::move(what)) {}
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void show(Eigen::Index done, Eigen::Index total);
  void clear();

 private:
  std::string what_;
  bool shown_ = false;
};

}  // namespace llmt::apps
