#include "dynamics/windows.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/one_step.hpp"

namespace llmt {
namespace {

constexpr double ranges_outside = 10.0;

}  // namespace
std::vector<Window> windows_of(const std::vector<Stretch>& stretches, Eigen::Index initial, Eigen::Index horizon) {
  std::vector<Window> windows;
  for (const Stretch& stretch : stretches) {
    Eigen::Index first = stretch.begin + initial;
    while (first < stretch.end) {
      const Eigen::Index end = horizon == 0 ? stretch.end : std::min(stretch.end, first + horizon);
      if (horizon == 0 || 2 * (end - first) >= horizon) windows.push_back({first - initial, first, end});
      first = end;
    }
  }
  return windows;
}

RegressorRows regressor_rows(const Series& series, const Lags& lags, const std::vector<Stretch>& stretches,
                             Eigen::Index initial) {
  const std::vector<LaggedColumn> columns = columns_of(lags);
  RegressorRows result;
  for (const Stretch& stretch : stretches) {
    for (Eigen::Index row = stretch.begin + initial; row < stretch.end; ++row) result.rows.push_back(row);
  }
  result.regressors.resize(std::ssize(result.rows), std::ssize(columns));
  result.outputs.resize(std::ssize(result.rows), series.outputs.cols());
  result.last.setZero(std::ssize(result.rows), series.outputs.cols());
  Eigen::VectorXd last(series.outputs.cols());
  const Outputs measured(series.outputs);
  Eigen::VectorXd x(std::ssize(columns));
  for (Eigen::Index k = 0; k < std::ssize(result.rows); ++k) {
    regressors_of_run(columns, measured, result.rows[k], series.inputs, result.rows[k], x.data());
    result.regressors.row(k) = x.transpose();
    last.setZero();
    add_last(lags, measured, result.rows[k], last.data());
    result.last.row(k) = last.transpose();
    result.outputs.row(k) = series.outputs.row(result.rows[k]) - result.last.row(k);
  }
  return result;
}

Eigen::Index run_window(const DynamicParts& parts, const Series& series, const Window& window,
                        const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, Eigen::MatrixXd& outputs) {
  const std::vector<LaggedColumn> columns = columns_of(parts.lags);
  OneStep map(parts);
  const Eigen::Index count = window.end - window.begin;
  Outputs run(series.outputs.middleRows(window.begin, count));
  Eigen::VectorXd x(std::ssize(columns));
  Eigen::VectorXd y(run.held.cols());
  Eigen::Index left_at = -1;
  for (Eigen::Index row = window.first; row < window.end && left_at < 0; ++row) {
    const Eigen::Index here = row - window.begin;
    regressors_of_run(columns, run, here, series.inputs, row, x.data());
    map.values(x.data(), y.data());
    add_last(parts.lags, run, here, y.data());
    run.free.row(here) = y.transpose();
    for (Eigen::Index o = 0; o < y.size(); ++o) run.held(here, o) = held_at_stops(parts.outputs[o], y(o));
    if (((y.array() >= lower.array()) && (y.array() <= upper.array())).all()) continue;
    run.held.bottomRows(count - here - 1).setConstant(std::nan(""));
    left_at = row;
  }
  outputs = std::move(run.held);
  return left_at;
}

Eigen::VectorXd lower_bounds(const std::vector<Signal>& outputs) {
  Eigen::VectorXd bounds(std::ssize(outputs));
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    bounds(o) = outputs[o].low - ranges_outside * (outputs[o].high - outputs[o].low);
  }
  return bounds;
}

Eigen::VectorXd upper_bounds(const std::vector<Signal>& outputs) {
  Eigen::VectorXd bounds(std::ssize(outputs));
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    bounds(o) = outputs[o].high + ranges_outside * (outputs[o].high - outputs[o].low);
  }
  return bounds;
}

}  // namespace llmt
