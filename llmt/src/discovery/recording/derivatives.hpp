// Derivatives of signals by time, and inputs that are derivatives of each other.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Where the recording begins and ends that a place in time is part of: [begin, end) of the sequence.
struct Recorded {
  Eigen::Index begin = 0;
  Eigen::Index end = 0;
};

/// The step in time in the middle of all that go forwards; 0: there is none.
double median_step(const Rows& rows);

/// A longer step, in median steps, interrupts a recording.
inline constexpr double interruption = 3.0;

/// One for each place of the sequence. A recording ends where time jumps back or is interrupted.
std::vector<Recorded> recordings(const Rows& rows);

/// First and second derivatives by time at every row, of any column of values: local least squares of a polynomial of
/// the fourth degree over the rows within `half` places in time (Savitzky and Golay 1964, for any spacing). A window
/// ends where a run ends or the recording was interrupted.
class Derivatives {
 public:
  Derivatives(const Rows& rows, Eigen::Index half);

  Eigen::VectorXd first(const Eigen::VectorXd& values) const { return apply(1, values); }
  Eigen::VectorXd second(const Eigen::VectorXd& values) const { return apply(2, values); }
  /// The values `by` earlier (later, if negative), on the polynomial of the row nearest to that time; beyond the ends
  /// of a recording those at the end.
  Eigen::VectorXd earlier(const Eigen::VectorXd& values, double by) const;

 private:
  // The rows in a window. Windows that are alike, as nearly all are at a constant rate, share their weights: a row for
  // each coefficient of the polynomial; null: none.
  struct Stencil {
    Eigen::Index begin = 0;  // place in the sequence
    double width = 1.0;      // time that is 1 for the polynomial
    std::shared_ptr<const Eigen::MatrixXd> weights;
  };
  std::vector<Eigen::Index> sequence_;
  std::vector<Recorded> recorded_;
  Eigen::VectorXd times_;  // of the places
  std::vector<Stencil> stencils_;

  Eigen::VectorXd apply(int order, const Eigen::VectorXd& values) const;
};

/// Derivatives of signals are those of polynomials over so many lags (see smooth_lag()) to both sides.
inline constexpr Eigen::Index lags_of_a_window = 2;
/// Fewer rows have no derivatives to speak of.
inline constexpr Eigen::Index fewest_for_derivatives = 60;
/// Times that differ by less, relative to a window or a step, are the same.
inline constexpr double same_time = 1e-7;

struct Motion {
  Eigen::Index position = 0;  ///< columns of the inputs
  Eigen::Index speed = 0;
  Eigen::Index acceleration = 0;
  double second = 1.0;  ///< in units of the instants
};

/// Found by comparing derivatives of the inputs with the other inputs.
std::vector<Motion> motions(const Derivatives& derivatives, const Inputs& inputs);

/// Whether an input is the first or second derivative by time of an output (n values).
bool is_derivative_of(const Derivatives& derivatives, const Eigen::VectorXd& input, const Eigen::VectorXd& output);

}  // namespace llmt::discovery
