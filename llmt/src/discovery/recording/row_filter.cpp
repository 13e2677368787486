#include "discovery/recording/row_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "discovery/recording/derivatives.hpp"
#include "discovery/recording/refuse.hpp"
#include "discovery/signals/kernel.hpp"

namespace llmt::discovery {
namespace {

std::vector<Crossing> crossings_of(const Eigen::MatrixXd& inputs,
                                   const std::vector<std::vector<Eigen::Index>>& pieces) {
  std::vector<Crossing> crossings;
  for (Eigen::Index j = 0; j < inputs.cols(); ++j) {
    for (const std::vector<Eigen::Index>& piece : pieces) {
      for (std::size_t k = 1; k + 2 < piece.size(); ++k) {
        const double before = inputs(piece[k], j);
        const double after = inputs(piece[k + 1], j);
        if (!(before * after < 0.0)) continue;
        crossings.push_back({{piece[k - 1], piece[k], piece[k + 1], piece[k + 2]}, 0.5 - before / (before - after)});
      }
    }
  }
  return crossings;
}

}  // namespace

RowFilter::RowFilter(const Rows& rows, const Eigen::MatrixXd& inputs, double cutoff) {
  step_ = median_step(rows);
  constexpr double uneven = 0.5;  // steps
  for (std::size_t k = 0; k < rows.sequence.size(); ++k) {
    const double step = k == 0 ? 0.0 : rows.instants(rows.sequence[k]) - rows.instants(rows.sequence[k - 1]);
    if (k == 0 || !(std::abs(step - step_) < uneven * step_)) pieces_.emplace_back();
    pieces_.back().push_back(rows.sequence[k]);
  }
  stride_ = step_ > 0.0 ? independent_step(cutoff, step_) : 1;
  if (stride_ < 2) {
    refuse("find_missing",
           fmt::format("rows are {:.4g} apart, too far to filter the simulation at {:.4g} per unit of time "
                       "as the measured outputs were",
                       step_, cutoff));
  }
  weights_ = low_pass(cutoff, step_);
  crossings_ = std::make_shared<const std::vector<Crossing>>(crossings_of(inputs, pieces_));
}

Eigen::MatrixXd RowFilter::operator()(const Eigen::MatrixXd& of_rows) const {
  Eigen::MatrixXd jumping = of_rows;
  for (Eigen::Index c = 0; c < of_rows.cols(); ++c) jumping.col(c) = jumping_at(*crossings_, of_rows.col(c));
  Eigen::MatrixXd filtered = of_rows;
  const Eigen::Index half = weights_.size() / 2;
  for (const std::vector<Eigen::Index>& piece : pieces_) {
    const Eigen::MatrixXd own = jumping(piece, Eigen::all);
    for (Eigen::Index k = 0; k < own.rows(); ++k) {
      const Eigen::Index begin = std::max<Eigen::Index>(0, k - half);
      const Eigen::Index count = std::min(own.rows(), k + half + 1) - begin;
      const auto weights = weights_.segment(begin - (k - half), count);
      filtered.row(piece[k]) = weights.transpose() * own.middleRows(begin, count) / weights.sum();
    }
  }
  return filtered;
}

ErrorsOfSteps::ErrorsOfSteps(const RowFilter& filter, const Rows& rows, const Eigen::MatrixXd& inputs, double cutoff) {
  constexpr Eigen::Index fewest = 4;  // rows in an independent one, of which half are left
  if (filter.stride() < fewest) return;
  for (const std::vector<Eigen::Index>& piece : filter.pieces()) {
    for (std::size_t k = 0; k < piece.size(); k += 2) {
      kept_.push_back(piece[k]);
      next_.push_back(piece[std::min(k + 1, piece.size() - 1)]);
    }
  }
  Rows half{.inputs = {},
            .simulated = {},
            .sequence = std::vector<Eigen::Index>(kept_.size()),
            .instants = rows.instants(kept_)};
  std::iota(half.sequence.begin(), half.sequence.end(), Eigen::Index{0});
  of_kept_.emplace(half, inputs(kept_, Eigen::all), cutoff);
}

Eigen::MatrixXd ErrorsOfSteps::squares(const RowFilter& filter, const Eigen::MatrixXd& of_rows) const {
  constexpr double order = 3.0;  // 2^2 - 1
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(of_rows.rows(), of_rows.cols());
  if (!of_kept_) return squares;
  const Eigen::MatrixXd change = filter(of_rows)(kept_, Eigen::all) - (*of_kept_)(of_rows(kept_, Eigen::all));
  squares(kept_, Eigen::all) = (change / order).cwiseAbs2();
  squares(next_, Eigen::all) = squares(kept_, Eigen::all).eval();
  return squares;
}

}  // namespace llmt::discovery
