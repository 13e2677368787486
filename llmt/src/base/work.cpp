#include "base/work.hpp"

#include <algorithm>
#include <numeric>

namespace llmt {
namespace {

// Where a stage does more than was expected of it, this part of what was to come stays.
constexpr double part_that_stays = 0.1;

}  // namespace

void Stage::expect(double operations) const {
  if (work_ != nullptr) work_->expect(index_, operations);
}

void Stage::did(double operations) const {
  if (work_ != nullptr) work_->did(index_, operations);
}

double Stage::to_come() const { return work_ != nullptr ? work_->state(index_).first : 0.0; }

double Stage::done() const { return work_ != nullptr ? work_->state(index_).second : 0.0; }

Stage Stage::another(double operations) const { return work_ != nullptr ? work_->stage(operations) : Stage(); }

Stage Work::stage(double operations) {
  const std::lock_guard<std::mutex> lock(mutex_);
  to_come_.push_back(operations);
  done_.push_back(0.0);
  return {*this, to_come_.size() - 1};
}

void Work::expect(std::size_t stage, double operations) {
  const std::lock_guard<std::mutex> lock(mutex_);
  to_come_[stage] = operations;
}

std::pair<double, double> Work::state(std::size_t stage) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {to_come_[stage], done_[stage]};
}

void Work::did(std::size_t stage, double operations) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double before = std::accumulate(to_come_.begin(), to_come_.end(), 0.0);
  double& of_stage = to_come_[stage];
  of_stage = operations <= of_stage ? of_stage - operations : part_that_stays * of_stage;
  const double after = std::accumulate(to_come_.begin(), to_come_.end(), 0.0);
  done_[stage] += operations;
  all_done_ += operations;
  if (before > 0.0) share_ = 1.0 - (1.0 - share_) * (after / before);
  if (report_) report_(share_, all_done_);
}

}  // namespace llmt
