/// \file
/// How far a long job is.
#pragma once

#include <Eigen/Core>
#include <chrono>
#include <string>

#include "llmt/progress.hpp"

namespace llmt::apps {

/// "fitting [######........] 43 %, about 12 s left" on one line of stderr, rewritten in place. Nothing is shown in the
/// first two seconds, and nothing where stderr is no terminal.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what);
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// A callback that shows what the library reports; empty where stderr is no terminal. It must not outlive the bar.
  Progress callback();

  /// `done` of `total` steps of about equal length. What is left is the time so far divided by the share that is done,
  /// times the share that is not.
  void show(Eigen::Index done, Eigen::Index total);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  bool is_terminal_;
  Clock::time_point begin_;
  Clock::time_point last_;  // when it was shown
  bool shown_ = false;
};

/// "8 s", "3 min", "2 h".
std::string duration_text(double seconds);

/// The line itself. `done` of `total` after `seconds`; without a total only the time.
std::string progress_line(const std::string& what, Eigen::Index done, Eigen::Index total, double seconds);

}  // namespace llmt::apps
