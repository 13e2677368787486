// The progress of a call that searches several times.
#pragma once

#include <memory>

#include "llmt/progress.hpp"

namespace llmt::discovery {

/// How many searches there will be is not known, so each counts as half of what the ones before it left.
class ProgressOfSearches {
 public:
  explicit ProgressOfSearches(Progress whole);

  /// What the searches report to, one after another. Empty if that of the whole call is.
  Progress of_each() const;

  /// Reports the whole call as complete. Throws Cancelled if the callback says so.
  void finish() const;

 private:
  struct Shown;
  std::shared_ptr<Shown> shown_;  // null: nobody watches
};

}  // namespace llmt::discovery
