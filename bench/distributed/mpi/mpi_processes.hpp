/// \file
/// The processes of an MPI job as those that share a fit.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "trees/arrow_fit.hpp"

namespace llmt::apps {

/// The processes of MPI_COMM_WORLD. A pass is one reduction, along a binary tree of ranks: the sums of a process go to
/// a lower rank once, log2(count) steps at most one after the other; the next state comes back the same way.
///
/// No wait is endless: a process that has waited longer than `patience` for another throws std::runtime_error that
/// names it.
class MpiProcesses : public Processes {
 public:
  explicit MpiProcesses(std::chrono::duration<double> patience);

  Eigen::Index rank() const override { return rank_; }
  Eigen::Index count() const override { return count_; }
  distributed::Sums merged(distributed::Sums own) override;
  std::string of_first(std::string bytes) override;
  std::string cost() const override;

 private:
  void send(const std::string& bytes, int to);
  std::string receive(int from);
  template <class Begin>
  void transfer(int other, const Begin& begin);

  std::chrono::duration<double> patience_;
  std::chrono::duration<double> waited_{0.0};  ///< in messages, for other processes to come to them included
  std::uint64_t received_ = 0;                 ///< bytes
  int rank_ = 0;
  int count_ = 1;
};

}  // namespace llmt::apps
