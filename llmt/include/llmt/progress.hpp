/// \file
/// How far a long call is, and a way to stop it.
///
///     const llmt::Progress progress = [](const llmt::ProgressReport& report) {
///       std::printf("%d of %d\n", report.done, report.total);
///       return true;  // false cancels the fit
///     };
///     const llmt::Model fitted = llmt::fit(inputs, outputs, {}, progress).model;
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <string>

namespace llmt {

/// How far a call is.
struct ProgressReport {
  int done = 0;      ///< never falls from report to report
  int total = 0;     ///< the same in all reports of a call
  std::string step;  ///< what is being done, such as "searching, round 2"; empty where the steps have no names
};

/// What a call that takes long is given to report to. An empty one is not called.
///
/// The callback is called on the calling thread and on the threads that work for it, one call at a time; it must not
/// call the library. It is called as tasks end, and within long tasks, also while `done` stays the same. The last
/// report of a call that succeeds is the only one with `done` equal to `total`, and comes on the calling thread.
///
/// If the callback returns false, the call throws Cancelled. If it throws, the call throws the same exception. In both
/// cases the callback is not called again, the tasks that are under way end at their next report, and the exception
/// leaves the call after all of them have ended. Nothing of the call remains.
using Progress = std::function<bool(const ProgressReport& report)>;

/// Thrown by a call whose progress callback returned false.
class Cancelled : public std::exception {
 public:
  const char* what() const noexcept override { return "cancelled by the progress callback"; }
};

/// Counts the work of a call, for functions that take a Progress. A part of the work is counted on its own:
///
///     void learn(const llmt::Progress& progress) {
///       llmt::Work work(progress);
///       for (int k = 0; k < 10; ++k) {
///         llmt::Work part(work, 0.09);
///         llmt::fit(inputs, outputs, {}, part.progress());  // the fit reports as a part of the work
///       }
///       work.finish();
///     }
///
/// Several threads may count parts of the same work, or the same part. A report may throw, see Progress.
class Work {
 public:
  /// The whole work of a call. An empty `progress`: nothing is counted, and nothing stops it.
  explicit Work(Progress progress = {});

  /// A part of `whole`, which must live longer. `share`: of the whole, from 0 to 1.
  Work(Work& whole, double share) : root_(whole.root_), whole_(&whole), share_(share) {}

  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  /// Counts a share of this work as done and reports. All shares together count as 1 at most.
  void did(double share);

  /// Reports, so that the callback may stop the work here.
  void check() { did(0.0); }

  /// Counts all that is not counted yet. The whole work of a call is reported as complete, which must come once.
  void finish();

  /// The share of this work that is not counted yet.
  double left() const;

  /// Names the step that begins, and reports.
  void begin(const std::string& step);

  /// A progress for a call that is this part of the work. It must not be called after this part has ended.
  Progress progress();

 private:
  struct Root;
  void add(double share);

  std::shared_ptr<Root> root_;  // null: nothing is counted
  Work* whole_ = nullptr;
  double share_ = 1.0;  // of `whole_`
  double done_ = 0.0;   // of this work
};

}  // namespace llmt
