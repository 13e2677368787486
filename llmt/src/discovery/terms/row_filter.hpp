// The low pass that measured outputs went through, for what is computed at the rows.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "discovery/terms/samples.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Rows in time at even steps, in pieces without a gap.
class RowFilter {
 public:
  /// Inputs::cutoff is above 0. Throws std::invalid_argument for rows that are too far apart for it.
  explicit RowFilter(const Inputs& inputs);

  /// Rows in the order of time, piece after piece.
  const std::vector<std::vector<Eigen::Index>>& pieces() const { return pieces_; }
  /// 2 h + 1 of them add up to 1.
  const Eigen::VectorXd& weights() const { return weights_; }
  const std::shared_ptr<const std::vector<Crossing>>& crossings() const { return crossings_; }
  /// Rows after which white noise that was filtered counts as independent.
  Eigen::Index stride() const { return stride_; }
  double step() const { return step_; }

  /// Columns of values at all rows, filtered. At the ends of a piece the weights that are left count.
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& of_rows) const;

 private:
  std::vector<std::vector<Eigen::Index>> pieces_;
  Eigen::VectorXd weights_;
  std::shared_ptr<const std::vector<Crossing>> crossings_;
  Eigen::Index stride_ = 1;
  double step_ = 0.0;
};

/// Squares of the errors of as_measured() where what is computed changes between rows, n x d: a third of the change if
/// every other row is left out (Richardson 1911), at rows left out that of their neighbour. 0 where rows are too far
/// apart to leave some out.
Eigen::MatrixXd squared_errors_of_steps(const Inputs& inputs, const Eigen::MatrixXd& of_rows);

/// What is computed at the rows, as the measured outputs are: filtered if these are.
Eigen::MatrixXd as_measured(const Inputs& inputs, const Eigen::MatrixXd& of_rows);

}  // namespace llmt::discovery
