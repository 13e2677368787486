#include "llmt/progress.hpp"

#include <algorithm>
#include <mutex>

namespace llmt {

// The state that all parts of the work of a call share.
struct Work::Root {
  static constexpr int total = 1000;

  // With the mutex locked.
  void report(int done) {
    if (stopped) std::rethrow_exception(stopped);
    last.done = done;
    try {
      if (!progress(last)) throw Cancelled();
    } catch (...) {
      stopped = std::current_exception();
      throw;
    }
  }

  Progress progress;
  std::mutex mutex;  // of all that is below, and of what the parts have done
  Work* whole = nullptr;
  ProgressReport last{.done = 0, .total = total, .step = {}};
  std::exception_ptr stopped;
};

Work::Work(Progress progress) {
  if (!progress) return;
  root_ = std::make_shared<Root>();
  root_->progress = std::move(progress);
  root_->whole = this;
}

void Work::did(double share) {
  if (!root_) return;
  const std::lock_guard lock(root_->mutex);
  add(share);
  root_->report(std::min(static_cast<int>(Root::total * root_->whole->done_), Root::total - 1));
}

void Work::add(double share) {
  const double added = std::clamp(share, 0.0, 1.0 - done_);
  done_ += added;
  if (whole_ != nullptr) whole_->add(share_ * added);
}

void Work::finish() {
  did(1.0);
  if (!root_ || whole_ != nullptr) return;
  const std::lock_guard lock(root_->mutex);
  root_->report(Root::total);
}

double Work::left() const {
  if (!root_) return 1.0;
  const std::lock_guard lock(root_->mutex);
  return 1.0 - done_;
}

void Work::begin(const std::string& step) {
  if (!root_) return;
  {
    const std::lock_guard lock(root_->mutex);
    root_->last.step = step;
  }
  check();
}

Progress Work::progress() {
  if (!root_) return {};
  return [this](const ProgressReport& report) {
    did(static_cast<double>(report.done) / report.total - (1.0 - left()));
    return true;
  };
}

}  // namespace llmt
