#include "shared/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "shared/standard_error.hpp"

namespace llmt::apps {

std::string duration_text(double seconds) {
  constexpr double minute = 60.0;
  constexpr double hour = 3600.0;
  if (seconds < 2.0 * minute) return fmt::format("{:.0f} s", std::max(1.0, seconds));
  return seconds < 2.0 * hour ? fmt::format("{:.0f} min", seconds / minute) : fmt::format("{:.0f} h", seconds / hour);
}

std::string progress_line(const std::string& what, Eigen::Index done, Eigen::Index total, double seconds) {
  if (total <= 0 || done <= 0) return fmt::format("{}, {}", what, duration_text(seconds));
  constexpr int bar = 30;
  constexpr double most = 0.99;  // what is not finished is not complete
  const double share = std::min(most, static_cast<double>(done) / static_cast<double>(total));
  const int filled = static_cast<int>(bar * share);
  return fmt::format("{} [{}{}] {:.0f} %, about {} left", what, std::string(filled, '#'),
                     std::string(bar - filled, '.'), std::floor(100.0 * share),
                     duration_text(seconds * (1.0 - share) / share));
}

ProgressBar::ProgressBar(std::string what)
    : what_(std::move(what)), is_terminal_(::isatty(STDERR_FILENO) != 0), begin_(Clock::now()), last_(begin_) {}

Progress ProgressBar::callback() {
  if (!is_terminal_) return {};
  return [this](const ProgressReport& report) {
    show(report.done, report.total);
    return true;
  };
}

void ProgressBar::show(Eigen::Index done, Eigen::Index total) {
  if (!is_terminal_) return;
  constexpr std::chrono::seconds quiet(2);
  constexpr std::chrono::milliseconds between(100);
  const Clock::time_point now = Clock::now();
  if (now - begin_ < quiet || (shown_ && now - last_ < between)) return;
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  write_stderr(fmt::format("\r{}\033[K", progress_line(what_, done, total, seconds)));
  shown_ = true;
}

void ProgressBar::clear() {
  if (shown_) {
    write_stderr("\r\033[K");
    shown_ = false;
  }
}

}  // namespace llmt::apps
