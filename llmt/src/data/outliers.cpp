#include "llmt/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "base/sum_over.hpp"
#include "llmt/statistics.hpp"

namespace llmt {
namespace {

constexpr double normal_by_median = 1.4826;  // standard deviation of a normal variable by its median absolute value
constexpr double dominant_share = 0.9;
constexpr Eigen::Index one_row_in = 100;
constexpr double far_spreads = 20.0;

// Of fewer rows any one may carry most of the squares.
constexpr Eigen::Index fewest_rows_of_share = 10;

}  // namespace

RobustScale robust_scale(const Eigen::Ref<const Eigen::VectorXd>& values) {
  if (values.size() == 0) throw std::invalid_argument("llmt::robust_scale: there is no value");
  const double centre = median(values);
  return {centre, normal_by_median * median((values.array() - centre).abs())};
}

DominantRows dominant_rows(const Eigen::Ref<const Eigen::VectorXd>& output) {
  const RobustScale scale = robust_scale(output);
  const Eigen::VectorXd distance = (output.array() - scale.median).abs();
  const double farthest = distance.maxCoeff();
  if (!(scale.deviation > 0.0 && farthest > far_spreads * scale.deviation)) return {};
  const Eigen::VectorXd squares = (distance / farthest).array().square();  // so that they stay finite
  const double all = sum_of_rows(squares.size(), [&](Eigen::Index row) { return squares(row); });
  std::vector<Eigen::Index> rows(output.size());
  std::iota(rows.begin(), rows.end(), Eigen::Index{0});
  const Eigen::Index most = std::max<Eigen::Index>(1, output.size() / one_row_in);
  const auto end = rows.begin() + most;
  std::ranges::partial_sort(rows, end, [&](Eigen::Index a, Eigen::Index b) {
    return distance(a) != distance(b) ? distance(a) > distance(b) : a < b;
  });
  DominantRows dominant;
  for (auto row = rows.begin(); row != end && dominant.share < dominant_share; ++row) {
    if (distance(*row) <= far_spreads * scale.deviation) break;
    dominant.rows.push_back(*row);
    dominant.share += squares(*row) / all;
  }
  if (dominant.share < dominant_share) return {};
  dominant.hide_the_others = farthest * std::numeric_limits<double>::epsilon() > scale.deviation;
  if (output.size() < fewest_rows_of_share && !dominant.hide_the_others) return {};
  return dominant;
}

}  // namespace llmt
