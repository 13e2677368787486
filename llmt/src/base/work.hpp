/// \file
/// How far a long computation is, counted in operations.
#pragma once

#include <functional>
#include <mutex>
#include <utility>
#include <vector>

namespace llmt {

class Work;

/// A stage of some work: a handle that is copied. Without a Work it counts nothing.
class Stage {
 public:
  Stage() = default;

  /// From now on this many operations of the stage are to come; 0 when it is over. What was done stays done.
  void expect(double operations) const;

  /// Adds `operations` to those that are done.
  void did(double operations) const;

  double to_come() const;
  double done() const;

  /// Another stage of the same work.
  Stage another(double operations) const;

 private:
  friend class Work;
  Stage(Work& work, std::size_t index) : work_(&work), index_(index) {}

  Work* work_ = nullptr;
  std::size_t index_ = 0;
};

/// The work of a computation in stages, of which several may go on at a time.
///
/// An operation is a multiplication and an addition of dense linear algebra, or what takes as long. What is to come is
/// an estimate, which gets better on the way: the share that is done is carried on from where it stands to 1, in
/// proportion to what is to come, so that it never falls and never leaps because an estimate was wrong.
class Work {
 public:
  /// `report`: called with the share that is done, from 0 to 1, which never falls, and the operations that were
  /// counted; one call at a time. May be empty.
  explicit Work(std::function<void(double share, double operations)> report) : report_(std::move(report)) {}
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  /// A new stage, of which `operations` are to come.
  Stage stage(double operations);

 private:
  friend class Stage;
  void expect(std::size_t stage, double operations);
  void did(std::size_t stage, double operations);
  std::pair<double, double> state(std::size_t stage);  // to come, and done

  std::function<void(double share, double operations)> report_;
  std::mutex mutex_;
  std::vector<double> to_come_;  // of each stage
  std::vector<double> done_;     // of each stage
  double all_done_ = 0.0;
  double share_ = 0.0;
};

}  // namespace llmt
