// Rows as they were taken, made ready once: what every search of them needs to know.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "discovery/recording/derivatives.hpp"
#include "discovery/recording/noise.hpp"
#include "discovery/recording/samples.hpp"
#include "discovery/recording/surrogate.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Throws std::invalid_argument as standard_terms() does for inputs.
void check_inputs(const Inputs& inputs);

/// The column of Inputs::order, which is not empty. Throws std::invalid_argument where there is none of that name.
Eigen::Index order_column(const Inputs& inputs);

/// Runs, cut where the recording was interrupted.
struct Pieces {
  std::vector<Piece> rows;
  std::vector<Eigen::Index> runs;  ///< of every piece
  double step = 0.0;               ///< median time between rows
};

/// What takes time to find out is found out when it is asked for first, and kept. For one thread at a time.
class Recording {
 public:
  /// Throws as rows_of().
  explicit Recording(Inputs inputs);

  /// The same rows, where terms take inputs within these bands for 0.
  Recording with_zero_bands(Eigen::VectorXd bands) const;
  /// The same rows at other values of the inputs.
  Recording with_values(Eigen::MatrixXd values) const;

  const Inputs& inputs() const { return inputs_; }
  /// For terms; the simulated output is 0.
  const Rows& rows() const { return rows_; }
  bool is_in_time() const { return inputs_.instants.size() > 0; }
  /// Whether the measured outputs went through a filter: so do the simulation and the terms.
  bool is_filtered() const { return inputs_.cutoff > 0.0; }

  /// Of rows in time. Throws std::invalid_argument for two rows at one time, and where no run has two rows.
  const Pieces& pieces() const;
  /// Inputs that vary, with their noise in time.
  const std::vector<Signal>& signals() const;
  bool is_smooth(Eigen::Index input) const;

  /// Of filtered rows.
  const RowFilter& filter() const;
  /// What is computed at the rows, as the measured outputs are: filtered where it is_filtered().
  Eigen::MatrixXd as_measured(const Eigen::MatrixXd& of_rows) const;
  /// Of filtered rows, see ErrorsOfSteps.
  Eigen::MatrixXd squared_errors_of_steps(const Eigen::MatrixXd& of_rows) const;

  /// By which no smooth input changes much, see smooth_lag().
  Eigen::Index lag() const;
  /// Over windows of that size.
  const Derivatives& derivatives() const;
  /// Inputs that are a position, its speed and its acceleration.
  const std::vector<Motion>& axes() const;
  /// Of the errors of the inputs, see covariance_of_errors().
  const Eigen::MatrixXd& covariance() const;
  /// Of outputs that were simulated at these inputs, n x d.
  std::shared_ptr<const Surrogate> surrogate(const Eigen::MatrixXd& simulated) const;

 private:
  struct SurrogateOf {
    Eigen::MatrixXd simulated;
    std::shared_ptr<const Surrogate> surrogate;
  };
  struct Known {
    std::shared_ptr<const Pieces> pieces;
    std::shared_ptr<const std::vector<Signal>> signals;
    std::shared_ptr<const RowFilter> filter;
    std::shared_ptr<const ErrorsOfSteps> errors_of_steps;
    std::shared_ptr<const Eigen::Index> lag;
    std::shared_ptr<const Derivatives> derivatives;
    std::shared_ptr<const std::vector<Motion>> axes;
    std::shared_ptr<const Eigen::MatrixXd> covariance;
    std::shared_ptr<const SurrogateOf> surrogate;
  };
  Inputs inputs_;
  Rows rows_;
  mutable Known known_;
};

}  // namespace llmt::discovery
