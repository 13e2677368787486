// What a fit counts as one observation, and the filter that measured outputs went through.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// An input passes zero between rows[1] and rows[2] of four that follow each other, at another place than the middle.
/// What jumps there, as dry friction does, counts at the rows as if it jumped in the middle: the weights on both sides
/// add up as if each row stood for half a step to either side. With v_k at the rows, the jump is, beside the smooth
/// change,
///
///     J = (v_2 - v_1) - ((v_1 - v_0) + (v_3 - v_2)) / 2,
///
/// and v_1, v_2 each become v + shift J / 2. A smooth v has next to no J.
struct Crossing {
  std::array<Eigen::Index, 4> rows;
  double shift = 0.0;  ///< of a step: 1/2 - the share of the step before the crossing
};

/// A column of values at the rows, as if it jumped where inputs pass zero.
Eigen::VectorXd jumping_at(const std::vector<Crossing>& crossings, Eigen::VectorXd of_rows);

/// Observations, each the mean over some rows: one row where rows are independent, a block of consecutive rows where
/// they were taken in time; or one row whose measured outputs went through a filter, and the weighted mean of what is
/// computed at the rows around it.
///
/// An equation y = s(x) + sum_j b_j T_j(x) + noise that is linear in the columns y, s and T_j holds for their means
/// over any rows too. The terms are computed at the rows, so the mean rounds nothing off, as a filter on x would
/// (parallel filtering and decimation, Gautier 1997).
class Samples {
 public:
  void add(std::span<const Eigen::Index> rows) {
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    ends_.push_back(std::ssize(rows_));
  }

  /// `around`: rows of the weights.
  void add(Eigen::Index row, std::span<const Eigen::Index> around, const Eigen::VectorXd& weights) {
    add(std::span(&row, 1));
    around_.insert(around_.end(), around.begin(), around.end());
    weights_ = weights;
  }

  /// Of what is computed, for samples that are filtered.
  void set_crossings(std::shared_ptr<const std::vector<Crossing>> crossings) { crossings_ = std::move(crossings); }
  const std::vector<Crossing>* crossings() const { return crossings_.get(); }

  Eigen::Index size() const { return std::ssize(ends_); }
  bool is_filtered() const { return weights_.size() > 0; }
  const Eigen::VectorXd& weights() const { return weights_; }
  /// Of a sample that is filtered.
  std::span<const Eigen::Index> around(Eigen::Index sample) const {
    return std::span(around_).subspan(sample * weights_.size(), weights_.size());
  }
  /// Of all samples, one after the other.
  const std::vector<Eigen::Index>& rows() const { return rows_; }
  std::span<const Eigen::Index> rows_of(Eigen::Index sample) const {
    const Eigen::Index begin = sample == 0 ? 0 : ends_[sample - 1];
    return std::span(rows_).subspan(begin, ends_[sample] - begin);
  }

  /// Takes a sample of others over, whole.
  void add(const Samples& others, Eigen::Index sample) {
    if (others.is_filtered()) {
      crossings_ = others.crossings_;
      add(others.rows_of(sample).front(), others.around(sample), others.weights_);
    } else {
      add(others.rows_of(sample));
    }
  }

 private:
  std::vector<Eigen::Index> rows_;
  std::vector<Eigen::Index> ends_;
  std::vector<Eigen::Index> around_;
  Eigen::VectorXd weights_;
  std::shared_ptr<const std::vector<Crossing>> crossings_;
};

/// The share of the variance of a column that its means, `kept`, keep, 1 where samples are single rows. A column that
/// varies much faster than the samples keeps little: what is left of it is chance.
double share_kept(const Eigen::VectorXd& of_rows, const Eigen::VectorXd& kept, const Samples& samples);

/// The number of samples that carry a column, (sum u^2)^2 / sum u^4 of its deviations u from their mean.
double carriers(const Eigen::VectorXd& of_samples);

/// The mean of every sample of what is computed at the rows; samples x columns. `of_rows`: a row for each row of the
/// data.
Eigen::MatrixXd means(const Eigen::MatrixXd& of_rows, const Samples& samples);

/// The mean of every sample of what has been through the filter, as measured outputs have.
Eigen::MatrixXd means_of_filtered(const Eigen::MatrixXd& of_rows, const Samples& samples);

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
  /// Weights of the means of rows 1, 2 and 3 strides before and after a row, see kernel.hpp.
  Eigen::Vector3d uncorrelated_neighbours() const;

  /// Columns of values at all rows, filtered. At the ends of a piece the weights that are left count.
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& of_rows) const;

 private:
  std::vector<std::vector<Eigen::Index>> pieces_;
  Eigen::VectorXd weights_;
  std::shared_ptr<const std::vector<Crossing>> crossings_;
  Eigen::Index stride_ = 1;
  double step_ = 0.0;
  double cutoff_ = 0.0;
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
