#include "dynamics/other_orders.hpp"

#include <algorithm>
#include <limits>

#include "dynamics/windows.hpp"
#include "llmt/random.hpp"

namespace llmt {
namespace {

constexpr int num_orders = 4;
constexpr Eigen::Index times_the_record = 10;
constexpr Eigen::Index most_made_rows = 20000;
constexpr int most_block_rows = 50;
constexpr int num_tried = 20;  // places at which a block might begin

// Rows of the series, in the order of a made record. The first `memory` and one are consecutive.
std::vector<Eigen::Index> other_order(const Series& series, const std::vector<Stretch>& stretches, Eigen::Index memory,
                                      Eigen::Index count, Random& random) {
  const Eigen::VectorXd high = series.inputs.colwise().maxCoeff();
  const Eigen::VectorXd low = series.inputs.colwise().minCoeff();
  const Eigen::VectorXd scale = (high - low).cwiseMax(std::numeric_limits<double>::min());
  const auto distance = [&](Eigen::Index row, Eigen::Index other) {
    return (series.inputs.row(row) - series.inputs.row(other)).transpose().cwiseQuotient(scale).squaredNorm();
  };
  const auto some_stretch = [&]() -> const Stretch& { return stretches[random.below(stretches.size())]; };
  const auto some_row = [&](const Stretch& stretch) {
    return stretch.begin + static_cast<Eigen::Index>(random.below(static_cast<std::uint64_t>(stretch.rows())));
  };
  std::vector<Eigen::Index> rows;
  const Stretch& first = some_stretch();
  for (Eigen::Index k = 0; k <= std::min(memory, first.rows() - 1); ++k) rows.push_back(first.begin + k);
  while (std::ssize(rows) < count) {
    const Stretch* of = nullptr;
    Eigen::Index begin = 0;
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < num_tried; ++k) {
      const Stretch& stretch = some_stretch();
      const Eigen::Index row = some_row(stretch);
      if (const double far = distance(row, rows.back()); far < nearest) {
        of = &stretch;
        begin = row;
        nearest = far;
      }
    }
    if (of == nullptr) return rows;  // inputs that are not finite are in no stretch
    const auto length = static_cast<Eigen::Index>(1 + random.below(most_block_rows));
    for (Eigen::Index row = begin; row < std::min(begin + length, of->end); ++row) rows.push_back(row);
  }
  return rows;
}

}  // namespace

bool stays_over_other_orders(const Task& task, const DynamicParts& parts, const std::vector<Stretch>& stretches) {
  if (task.series.inputs.cols() == 0 || std::ranges::count(parts.lags.adds_up, true) > 0) return true;
  const Eigen::Index memory = longest_lag(parts.lags);
  std::vector<Stretch> long_enough;
  Eigen::Index all = 0;
  for (const Stretch& stretch : stretches) {
    if (stretch.rows() <= memory) continue;
    long_enough.push_back(stretch);
    all += stretch.rows();
  }
  if (long_enough.empty()) return true;
  const Eigen::VectorXd lower = lower_bounds(task.outputs);
  const Eigen::VectorXd upper = upper_bounds(task.outputs);
  Random random(1);
  for (int k = 0; k < num_orders; ++k) {
    const std::vector<Eigen::Index> rows =
        other_order(task.series, long_enough, memory, std::min(times_the_record * all, most_made_rows), random);
    Series made;
    made.inputs = task.series.inputs(rows, Eigen::all);
    made.outputs = task.series.outputs(rows, Eigen::all);  // those of the first rows begin the run
    Eigen::MatrixXd simulated;
    if (run_window(parts, made, {0, memory, std::ssize(rows)}, lower, upper, simulated) >= 0) return false;
  }
  return true;
}

}  // namespace llmt
