#include "fit/plan/memory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace llmt {
namespace {

constexpr double bytes = sizeof(double);

// Copies, in doubles: of the table and its regressors; of Gram matrices of one node, for the nodes that are examined
// together; of the matrix of a joint system. docs/algorithms/numerics.md sets the estimate beside measured peaks.
constexpr double copies_of_rows = 8.0;
constexpr double copies_of_gram = 16.0;
constexpr double copies_of_system = 3.0;

double square(Eigen::Index value) { return static_cast<double>(value) * static_cast<double>(value); }

}  // namespace

FitSize size_of(const TrainingRows& all, const Plan& plan, Eigen::Index leaves, Eigen::Index folds,
                Eigen::Index threads) {
  const Eigen::Index coefficients = std::ssize(all.regressors) + 1;
  const bool joint = !plan.candidates.widths.empty() && plan.candidates.estimation == Estimation::joint;
  return {.rows = all.count(),
          .inputs = all.table->inputs.cols(),
          .outputs = all.table->outputs.cols(),
          .coefficients = coefficients,
          .unknowns = joint ? leaves * coefficients : 0,
          .threads = std::clamp<Eigen::Index>(threads, 1, std::max<Eigen::Index>(folds, 1))};
}

double estimated_memory(const FitSize& size) {
  const auto rows = static_cast<double>(size.rows);
  const auto columns = static_cast<double>(size.inputs + size.coefficients + size.outputs);
  return bytes * (copies_of_rows * rows * columns + copies_of_gram * square(size.coefficients) +
                  copies_of_system * static_cast<double>(size.threads) * square(size.unknowns));
}

void refuse_beyond_memory(const FitSize& size, std::uintmax_t available) {
  const double estimate = estimated_memory(size);
  if (estimate <= static_cast<double>(available)) return;
  const std::string rows = size.rows == 0 ? "" : fmt::format("{} rows with ", size.rows);
  const std::string leaves = size.unknowns == 0 ? "" : fmt::format(" and {} leaves", size.unknowns / size.coefficients);
  // The Gram matrices of one node are needed whatever the rows and leaves are.
  const bool too_wide = bytes * copies_of_gram * square(size.coefficients) > static_cast<double>(available);
  throw std::runtime_error(
      fmt::format("{}{} inputs{} need about {:.1f} GB of memory, this machine has {:.1f} GB; take fewer inputs{}", rows,
                  size.inputs, leaves, estimate / 1e9, static_cast<double>(available) / 1e9,
                  too_wide ? "" : " or a lower limit of leaves, or fit a stream"));
}

}  // namespace llmt
