#include "dynamics/sensitivities.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "dynamics/one_step.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index rows_together = 128;

}  // namespace

template <class Visit>
bool run_with_sensitivities(const DynamicParts& parts, const Series& series, const Window& window,
                            const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, const Visit& visit) {
  const std::vector<LaggedColumn> columns = columns_of(parts.lags);
  OneStep map(parts);
  const Eigen::Index outputs = series.outputs.cols();
  const Eigen::Index memory = std::max<Eigen::Index>(1, longest_lag(parts.lags));
  Outputs run(series.outputs.middleRows(window.begin, window.end - window.begin));
  // Derivatives of the last rows without stops, in a ring: of row t in place t modulo memory.
  std::vector<Eigen::MatrixXd> past(memory, Eigen::MatrixXd::Zero(map.parameters(), outputs));
  Eigen::VectorXd x(std::ssize(columns));
  Eigen::VectorXd y(outputs);
  Eigen::MatrixXd by_regressor;
  Eigen::MatrixXd now;
  for (Eigen::Index row = window.first; row < window.end; ++row) {
    const Eigen::Index here = row - window.begin;
    regressors_of_run(columns, run, here, series.inputs, row, x.data());
    map.derivatives(x.data(), y.data(), by_regressor, now);
    // Whether the output at an earlier row moves with the parameters: it is not measured, and not at a stop.
    const auto moves = [&](Eigen::Index earlier, Eigen::Index output, bool is_held) {
      return earlier >= window.first - window.begin &&
             (!is_held || run.held(earlier, output) == run.free(earlier, output));
    };
    add_last(parts.lags, run, here, y.data());
    for (Eigen::Index o = 0; o < outputs; ++o) {
      if (adds_up(parts.lags, o) && moves(here - 1, o, true)) now.col(o) += past[(here - 1) % memory].col(o);
    }
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const LaggedColumn& column = columns[c];
      if (!column.is_output) continue;
      const auto add = [&](int lag, double sign, bool is_held) {
        const Eigen::Index earlier = here - lag;
        if (!moves(earlier, column.signal, is_held)) return;
        const auto& derivatives = past[earlier % memory].col(column.signal);
        for (Eigen::Index o = 0; o < outputs; ++o) now.col(o) += sign * by_regressor(o, c) * derivatives;
      };
      add(column.lag, 1.0, column.minus_lag < 0);
      if (column.minus_lag >= 0) add(column.minus_lag, -1.0, true);
    }
    run.free.row(here) = y.transpose();
    if (!((y.array() >= lower.array()) && (y.array() <= upper.array())).all() || !now.allFinite()) return false;
    past[here % memory] = now;
    for (Eigen::Index o = 0; o < outputs; ++o) {
      run.held(here, o) = held_at_stops(parts.outputs[o], y(o));
      if (run.held(here, o) == y(o)) continue;
      y(o) = run.held(here, o);
      now.col(o).setZero();
    }
    visit(row, y, now);
  }
  return true;
}

RunEquations run_equations(const DynamicParts& parts, const Series& series, const std::vector<Window>& windows,
                           const Eigen::VectorXd& scale) {
  const Eigen::Index parameters = OneStep(parts).parameters();
  const Eigen::VectorXd lower = lower_bounds(parts.outputs);
  const Eigen::VectorXd upper = upper_bounds(parts.outputs);
  RunEquations sums{0.0, 0.0, Eigen::MatrixXd::Zero(parameters, parameters), Eigen::VectorXd::Zero(parameters)};
  Eigen::MatrixXd block(parameters, rows_together);
  Eigen::VectorXd errors(rows_together);
  Eigen::Index filled = 0;
  const auto flush = [&] {
    if (filled == 0) return;  // Eigen divides by the number of columns
    sums.normal.selfadjointView<Eigen::Lower>().rankUpdate(block.leftCols(filled));
    sums.gradient += block.leftCols(filled) * errors.head(filled);
    filled = 0;
  };
  for (const Window& window : windows) {
    const bool stayed =
        run_with_sensitivities(parts, series, window, lower, upper,
                               [&](Eigen::Index row, const Eigen::VectorXd& y, const Eigen::MatrixXd& sensitivities) {
                                 for (Eigen::Index o = 0; o < y.size(); ++o) {
                                   const double error = (series.outputs(row, o) - y(o)) / scale(o);
                                   block.col(filled) = sensitivities.col(o) / scale(o);
                                   errors(filled++) = error;
                                   sums.cost += error * error;
                                   sums.rows += 1.0;
                                   if (filled == rows_together) flush();
                                 }
                               });
    if (!stayed) {
      sums.cost = std::numeric_limits<double>::infinity();
      return sums;
    }
  }
  flush();
  sums.normal = Eigen::MatrixXd(sums.normal.selfadjointView<Eigen::Lower>());
  return sums;
}

double run_cost(const DynamicParts& parts, const Series& series, const std::vector<Window>& windows,
                const Eigen::VectorXd& scale) {
  const Eigen::VectorXd lower = lower_bounds(parts.outputs);
  const Eigen::VectorXd upper = upper_bounds(parts.outputs);
  double cost = 0.0;
  Eigen::MatrixXd simulated;
  for (const Window& window : windows) {
    if (run_window(parts, series, window, lower, upper, simulated) >= 0) {
      return std::numeric_limits<double>::infinity();
    }
    for (Eigen::Index row = window.first; row < window.end; ++row) {
      for (Eigen::Index o = 0; o < simulated.cols(); ++o) {
        const double error = (series.outputs(row, o) - simulated(row - window.begin, o)) / scale(o);
        cost += error * error;
      }
    }
  }
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
}

}  // namespace llmt
