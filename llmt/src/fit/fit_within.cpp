#include <algorithm>
#include <optional>
#include <utility>

#include "base/checks.hpp"
#include "base/sizes_within.hpp"
#include "fit/plan/defaults.hpp"
#include "fit/prepared_rows.hpp"
#include "llmt/time_limit.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index leaves_at_first = 8;
// Joint estimates cost the square of the number of leaves, all else is linear in it.
constexpr double power_of_leaves = 1.5;
constexpr double preparing_share = 0.05;

// The number of leaves that a tree of these rows has at most.
Eigen::Index leaves_without_limit(const PreparedRows& rows) {
  const Plan plan = plan_of(*rows.training);
  if (plan.growth.max_leaves > 0) return plan.growth.max_leaves;
  return std::max<Eigen::Index>(rows.training->all.count() / std::max<Eigen::Index>(plan.growth.min_leaf_samples, 1),
                                1);
}

}  // namespace

TimedTree fit_within(double seconds, std::shared_ptr<const TrainingData> data, const FitOptions& options,
                     const Progress& progress) {
  check_seconds("llmt::fit_within", seconds);
  const double begin = steady_seconds();
  const Eigen::Index most = leaves_without_limit(PreparedFit(data, options).rows());
  std::optional<TimedTree> best;
  const auto fit_of_size = [&](Eigen::Index size, const Progress& told) {
    FitOptions limited = options;
    if (size < most) limited.max_leaves = size;
    Work work(told);
    Work preparing(work, preparing_share);
    PreparedFit prepared(data, limited, preparing.progress());
    Work fitting(work, work.left());
    FitResult result = fit(prepared, fitting.progress());
    best = {std::move(prepared), std::move(result), std::move(limited), {}};
    best->time = {seconds, steady_seconds() - begin, size, size < most};
  };
  sizes_within(seconds - (steady_seconds() - begin), {leaves_at_first, most, power_of_leaves}, fit_of_size, progress);
  return *std::move(best);
}

}  // namespace llmt
