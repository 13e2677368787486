/// \file
/// Which rows of a series are simulated and judged, and their regressors.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/dynamic_model.hpp"
#include "llmt/series.hpp"

namespace llmt {

/// A run: rows begin ... first - 1 are measured, first ... end - 1 are simulated and judged.
struct Window {
  Eigen::Index begin = 0;
  Eigen::Index first = 0;
  Eigen::Index end = 0;
};

/// Runs over stretches, each begun by `initial` measured rows, that are begun again after `horizon` simulated rows; 0:
/// never. A rest of less than half a horizon is left out.
std::vector<Window> windows_of(const std::vector<Stretch>& stretches, Eigen::Index initial, Eigen::Index horizon = 0);

/// Rows of one-step learning.
struct RegressorRows {
  Eigen::MatrixXd regressors;      ///< rows x columns
  Eigen::MatrixXd outputs;         ///< rows x outputs; of those that add up, the changes
  std::vector<Eigen::Index> rows;  ///< of the series
  Eigen::MatrixXd last = {};       ///< rows x outputs: what the changes are added to; 0 for the other outputs
};

/// The regressor matrix of all rows of the stretches whose past, `initial` rows, lies in the stretch.
RegressorRows regressor_rows(const Series& series, const Lags& lags, const std::vector<Stretch>& stretches,
                             Eigen::Index initial);

/// Outputs of a run, and the same without their stops.
struct Outputs {
  Eigen::MatrixXd held;  ///< rows x outputs
  Eigen::MatrixXd free;

  /// Measured values, of which nobody knows more.
  explicit Outputs(const Eigen::MatrixXd& measured) : held(measured), free(measured) {}
  Outputs() = default;
};

/// The regressors at row `row` of a run, that is row `input_row` of the inputs.
inline void regressors_of_run(const std::vector<LaggedColumn>& columns, const Outputs& outputs, Eigen::Index row,
                              const Eigen::MatrixXd& inputs, Eigen::Index input_row, double* x) {
  for (const LaggedColumn& column : columns) {
    if (!column.is_output) {
      *x++ = inputs(input_row - column.lag, column.signal);
    } else if (column.minus_lag < 0) {
      *x++ = outputs.held(row - column.lag, column.signal);
    } else {
      *x++ = outputs.free(row - column.lag, column.signal) - outputs.held(row - column.minus_lag, column.signal);
    }
  }
}

/// Adds to what the map gives at row `row` of a run the values before, of outputs that add up.
inline void add_last(const Lags& lags, const Outputs& run, Eigen::Index row, double* y) {
  for (std::size_t o = 0; o < lags.adds_up.size(); ++o) {
    if (lags.adds_up[o]) y[o] += run.held(row - 1, static_cast<Eigen::Index>(o));
  }
}

/// Holds outputs at their stops.
inline double held_at_stops(const Signal& output, double value) {
  return value < output.lower_stop ? output.lower_stop : output.upper_stop < value ? output.upper_stop : value;
}

/// Runs a window: outputs of its rows (begin ... end - 1); returns the row of the series at which an output left the
/// bounds of `lower` and `upper`, or -1.
Eigen::Index run_window(const DynamicParts& parts, const Series& series, const Window& window,
                        const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, Eigen::MatrixXd& outputs);

/// The bounds of a run, see DynamicModel::lower().
Eigen::VectorXd lower_bounds(const std::vector<Signal>& outputs);
Eigen::VectorXd upper_bounds(const std::vector<Signal>& outputs);

}  // namespace llmt
