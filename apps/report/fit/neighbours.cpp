#include "report/fit/neighbours.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "report/text/text.hpp"

namespace llmt::report {
namespace {

// Below this correlation the two errors are hardly different: of the rows of abalones, whose errors have a correlation
// of 0.25, blocks say 4 % more than random folds.
constexpr double weak = 0.5;

bool is_sorted(const Eigen::Ref<const Eigen::VectorXd>& values) {
  return std::is_sorted(values.begin(), values.end()) || std::is_sorted(values.begin(), values.end(), std::greater{});
}

}  // namespace

double neighbours_correlation(const TrainingData& data, const FitOptions& options, const FitResult& result) {
  const FitSummary& summary = result.summary;
  if (summary.repeats || !data.groups.empty() || options.folds.kind == FoldKind::contiguous) return 0.0;
  const std::vector<Model>& models = result.intervals.models();
  if (models.size() < 2) return 0.0;
  const Eigen::Index rows = data.inputs.rows();
  Eigen::MatrixXd errors = Eigen::MatrixXd::Constant(rows, data.outputs.cols(), std::nan(""));
  for (std::size_t f = 0; f < models.size(); ++f) {
    const std::vector<Eigen::Index>& held_out = summary.held_out[f];
    errors(held_out, Eigen::all) =
        models[f].predict(data.inputs(held_out, Eigen::all), options.max_threads) - data.outputs(held_out, Eigen::all);
  }
  double largest = 0.0;
  for (Eigen::Index o = 0; o < errors.cols(); ++o) {
    if (is_sorted(data.outputs.col(o))) continue;
    double products = 0.0, first = 0.0, second = 0.0;
    for (Eigen::Index row = 1; row < rows; ++row) {
      const double a = errors(row - 1, o);
      const double b = errors(row, o);
      if (std::isnan(a + b)) continue;
      products += a * b;
      first += a * a;
      second += b * b;
    }
    if (first > 0.0 && second > 0.0) largest = std::max(largest, products / std::sqrt(first * second));
  }
  return largest;
}

bool are_alike(double correlation, Eigen::Index rows) {
  return correlation > std::max(weak, 5.0 / std::sqrt(static_cast<double>(rows)));
}

std::string neighbours_text(double correlation, double rmse, std::optional<double> rmse_contiguous) {
  const std::string of_blocks =
      rmse_contiguous ? fmt::format("; with blocks of consecutive rows held out it is {}", number(*rmse_contiguous))
                      : "";
  return fmt::format(
      "Rows that follow each other are alike: their held-out errors have a correlation of {:.2f}. RMSE held-out {} is "
      "for new rows between those of the table{}. For rows of another "
      "time or path use --contiguous, or --groups if a column says which rows belong together",
      correlation, number(rmse), of_blocks);
}

}  // namespace llmt::report
