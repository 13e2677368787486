// The low pass that measured outputs went through, for what is computed at the rows.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "discovery/recording/samples.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// Rows in time at even steps, in pieces without a gap.
class RowFilter {
 public:
  /// `rows`: their order and instants; `inputs`: where columns jump. The cutoff is above 0. Throws
  /// std::invalid_argument for rows that are too far apart for it.
  RowFilter(const Rows& rows, const Eigen::MatrixXd& inputs, double cutoff);

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

/// The errors of filtered columns where what is computed changes between rows: a third of the change if every other row
/// is left out (Richardson 1911), at rows left out that of their neighbour. 0 where rows are too far apart to leave
/// some out.
class ErrorsOfSteps {
 public:
  /// `filter` and what it was made of.
  ErrorsOfSteps(const RowFilter& filter, const Rows& rows, const Eigen::MatrixXd& inputs, double cutoff);

  /// n x d of columns of values at all rows, by the same filter.
  Eigen::MatrixXd squares(const RowFilter& filter, const Eigen::MatrixXd& of_rows) const;

 private:
  std::vector<Eigen::Index> kept_;
  std::vector<Eigen::Index> next_;  // the row left out after it, or itself
  std::optional<RowFilter> of_kept_;
};

}  // namespace llmt::discovery
