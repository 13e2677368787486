#include "python/bindings/interruptible.hpp"

#include <nanobind/stl/string.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

namespace llmt::python {
namespace {

constexpr auto between_looks = std::chrono::milliseconds(50);

long looks = 0;  // for signals; under the interpreter's lock

struct Shared {
  std::mutex mutex;
  std::condition_variable ended;
  bool has_ended = false;
  bool cancelled = false;
  std::optional<ProgressReport> latest;
  std::exception_ptr failure;
};

void run(const std::function<void(const Progress&)>& work, Shared& shared) {
  std::exception_ptr failure;
  try {
    work([&shared](const ProgressReport& report) {
      const std::lock_guard lock(shared.mutex);
      shared.latest = report;
      return !shared.cancelled;
    });
  } catch (...) {
    failure = std::current_exception();
  }
  const std::lock_guard lock(shared.mutex);
  shared.failure = failure;
  shared.has_ended = true;
  shared.ended.notify_all();
}

}  // namespace

void check_signals() {
  ++looks;
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

long looks_for_signals() { return looks; }

void interruptible(const std::function<void(const Progress&)>& work, const nb::object& report) {
  Shared shared;
  std::exception_ptr raised;
  std::thread worker(run, std::cref(work), std::ref(shared));
  for (bool has_ended = false; !has_ended;) {
    std::optional<ProgressReport> latest;
    {
      const nb::gil_scoped_release unlocked;
      std::unique_lock lock(shared.mutex);
      has_ended = shared.ended.wait_for(lock, between_looks, [&] { return shared.has_ended; });
      latest = std::exchange(shared.latest, {});
    }
    if (raised) continue;
    try {
      check_signals();
      if (latest && !report.is_none()) report(latest->done, latest->total, latest->step);
    } catch (...) {
      raised = std::current_exception();
      const std::lock_guard lock(shared.mutex);
      shared.cancelled = true;
    }
  }
  {
    const nb::gil_scoped_release unlocked;
    worker.join();
  }
  if (raised) std::rethrow_exception(raised);
  if (shared.failure) std::rethrow_exception(shared.failure);
}

}  // namespace llmt::python
