/// \file
/// Programs of the user, run as children.
#pragma once

#include <string>
#include <string_view>

namespace llmt::apps {

/// How a child ended.
struct ChildOutcome {
  std::string out;          ///< what it wrote to standard output
  std::string err;          ///< the last characters of what it wrote to standard error
  int exit_code = 0;        ///< of a child that ended by itself, else -1
  int signal = 0;           ///< that ended it, or 0
  bool timed_out = false;   ///< it was ended because the time was over
  bool overflowed = false;  ///< it was ended because it wrote more than `longest_output`
};

inline constexpr std::size_t longest_output = std::size_t{1} << 30;

/// Runs `command` by /bin/sh with `input` as its standard input, for at most `seconds`. Input is written and both
/// outputs are read at the same time, so that neither side waits for the other. The child and what it started are a
/// process group; what is left of it when the child has ended, or when the time is over, is killed. Throws
/// std::runtime_error if it cannot be started.
ChildOutcome run_child(const std::string& command, std::string_view input, double seconds);

/// Kills the child that runs, if there is one: for handlers of signals.
void kill_running_child() noexcept;

}  // namespace llmt::apps
