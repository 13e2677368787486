#include "base/sizes_within.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace llmt {
namespace {

// Of the time that is left, what the next size is planned to take: estimates are rough, and what is late is lost.
constexpr double planned_share = 0.7;

// A step to less than this many times the size gains too little for doing it all again.
constexpr double least_growth = 1.5;

// Tells `progress` the time, and the task that is done to end when the time is over.
class Deadline {
 public:
  Deadline(double seconds, const Progress& progress, const Clock& clock)
      : seconds_(seconds), progress_(progress), clock_(clock), begin_(clock()) {}

  double elapsed() const { return clock_() - begin_; }
  double left() const { return seconds_ - elapsed(); }
  bool was_late() const { return was_late_; }

  // A `binding` one cancels what is late.
  Progress of_task(bool binding) {
    return [this, binding](const ProgressReport& report) {
      if (binding && left() < 0.0) {
        was_late_ = true;
        return false;
      }
      return tell(std::min(total - 1, static_cast<int>(total * elapsed() / seconds_)), report.step);
    };
  }

  void finish() { tell(total, ""); }

 private:
  static constexpr int total = 1000;

  bool tell(int done, const std::string& step) {
    told_ = std::max(told_, done);
    if (!progress_ || progress_({told_, total, step})) return true;
    throw Cancelled();
  }

  double seconds_;
  const Progress& progress_;
  const Clock& clock_;
  double begin_;
  int told_ = 0;
  bool was_late_ = false;
};

}  // namespace

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Eigen::Index sizes_within(double seconds, const SizeRange& sizes,
                          const std::function<void(Eigen::Index size, const Progress& progress)>& task,
                          const Progress& progress, const Clock& clock) {
  Deadline deadline(seconds, progress, clock);
  Eigen::Index size = std::min(sizes.least, sizes.most);
  task(size, deadline.of_task(false));
  double took = deadline.elapsed();
  while (size < sizes.most) {
    const double growth = std::pow(planned_share * std::max(deadline.left(), 0.0) / took, 1.0 / sizes.power);
    const double affordable = std::min(growth * static_cast<double>(size), static_cast<double>(sizes.most));
    const auto next = static_cast<Eigen::Index>(affordable);
    if (next < sizes.most && affordable < least_growth * static_cast<double>(size)) break;
    const double begin = deadline.elapsed();
    try {
      task(next, deadline.of_task(true));
    } catch (const Cancelled&) {
      if (!deadline.was_late()) throw;
      break;
    }
    size = next;
    took = deadline.elapsed() - begin;
  }
  deadline.finish();
  return size;
}

}  // namespace llmt
