#include "fit/plan/cheap_plan.hpp"

#include <algorithm>

namespace llmt {
namespace {

// Unknowns of the largest tree, which has at least this many leaves.
constexpr Eigen::Index most_unknowns = 900;
constexpr Eigen::Index fewest_leaves = 4;

Candidates few_candidates(Candidates candidates) {
  if (!candidates.widths.empty()) {
    candidates.widths = {1.0};
    candidates.jumps = {no_jump};
    if (!candidates.ridges.empty()) candidates.ridges = {1e-4, 1e-2};
  }
  candidates.shrinkages = {0.1, 1.0, 10.0};
  candidates.sparse = {false};
  return candidates;
}

}  // namespace

Plan cheap_plan(const Training& training) {
  Plan plan = plan_of(training);
  plan.candidates = few_candidates(std::move(plan.candidates));
  const Eigen::Index most = std::max(fewest_leaves, most_unknowns / (std::ssize(training.all.split_inputs) + 1));
  plan.growth.max_leaves = plan.growth.max_leaves > 0 ? std::min(plan.growth.max_leaves, most) : most;
  return plan;
}

}  // namespace llmt
