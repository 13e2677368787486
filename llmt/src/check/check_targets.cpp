#include "check/check_targets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "numerics/f_distribution.hpp"
#include "numerics/two_samples.hpp"
#include "spread/scaled_residuals.hpp"

namespace llmt {
namespace {

constexpr double not_tested = std::numeric_limits<double>::quiet_NaN();

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::vector<double> squares_of(const std::vector<double>& values) {
  std::vector<double> squares;
  for (const double value : values) squares.push_back(value * value);
  return squares;
}

// Degrees of freedom that a mean of squares has for each row: 1 of a normal distribution, less of one with heavy tails.
double freedom_per_row(const std::vector<double>& squares) {
  const double mean = mean_of(squares);
  double fourth = 0.0;
  for (const double square : squares) fourth += square * square / static_cast<double>(squares.size());
  if (!(mean > 0.0)) return 1.0;
  return 2.0 / std::max(fourth / (mean * mean) - 1.0, 0.5);
}

// Sums over new rows.
struct Errors {
  Eigen::Index rows = 0;
  double square = 0.0;  // of the errors
  double scaled = 0.0;  // of the errors divided by the spreads
  double spread = 0.0;  // squares of the spreads

  void add(double error, double of_spread) {
    ++rows;
    square += error * error;
    scaled += error * error / (of_spread * of_spread);
    spread += of_spread * of_spread;
  }
};

std::vector<CheckedLeaf> check_leaves(const JudgedTarget& judged, double freedom) {
  std::vector<Errors> errors(judged.leaves.size());
  for (Eigen::Index row = 0; row < judged.observed.size(); ++row) {
    if (std::isnan(judged.observed(row))) continue;
    errors[static_cast<std::size_t>(judged.leaf_of(row))].add(judged.observed(row) - judged.predicted(row),
                                                              judged.spreads(row));
  }
  std::vector<CheckedLeaf> leaves;
  for (std::size_t k = 0; k < errors.size(); ++k) {
    if (errors[k].rows == 0) continue;
    const auto rows = static_cast<double>(errors[k].rows);
    const LeafRecord& known = judged.leaves[k];
    CheckedLeaf leaf{.leaf = k,
                     .rows = errors[k].rows,
                     .rmse = std::sqrt(errors[k].square / rows),
                     .promised = std::sqrt(errors[k].spread / rows * known.mean_square),
                     .probability = not_tested};
    if (std::min(known.rows, errors[k].rows) >= fewest_checked_rows && known.mean_square > 0.0) {
      leaf.probability = f_survival(errors[k].scaled / rows / known.mean_square, freedom * rows,
                                    freedom * static_cast<double>(known.rows));
    }
    leaves.push_back(leaf);
  }
  return leaves;
}

}  // namespace

CheckedTarget check_target(const JudgedTarget& judged) {
  Errors errors;
  std::vector<double> scaled;
  Eigen::Index outside = 0;
  for (Eigen::Index row = 0; row < judged.observed.size(); ++row) {
    const double observed = judged.observed(row);
    if (std::isnan(observed)) continue;
    const double error = observed - judged.predicted(row);
    errors.add(error, judged.spreads(row));
    scaled.push_back(std::abs(error) / judged.spreads(row));
    if (judged.lower.size() > 0) outside += observed < judged.lower(row) || observed > judged.upper(row) ? 1 : 0;
  }
  CheckedTarget target{.name = judged.column.name,
                       .rows = errors.rows,
                       .rmse = not_tested,
                       .promised = not_tested,
                       .probability = not_tested,
                       .limit = not_tested,
                       .covered = not_tested,
                       .covered_probability = not_tested};
  if (errors.rows == 0) return target;
  const auto rows = static_cast<double>(errors.rows);
  target.rmse = std::sqrt(errors.square / rows);
  const Eigen::Index known = std::ssize(judged.held_out);
  if (known == 0) return target;
  const std::vector<double> squares = squares_of(judged.held_out);
  target.promised = std::sqrt(errors.spread / rows * mean_of(squares));
  if (judged.lower.size() > 0) target.covered = 1.0 - static_cast<double>(outside) / rows;
  if (std::min(known, errors.rows) < fewest_checked_rows) return target;
  target.probability = larger_mean_probability(squares, squares_of(scaled));
  if (judged.lower.size() > 0) {
    target.covered_probability = outside_probability(outside, errors.rows, values_outside(checked_level, known), known);
  }
  if (!judged.leaves.empty()) target.leaves = check_leaves(judged, freedom_per_row(squares));
  return target;
}

}  // namespace llmt
