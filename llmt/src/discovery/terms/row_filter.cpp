#include "discovery/terms/row_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "discovery/signals/kernel.hpp"
#include "discovery/terms/derivatives.hpp"
#include "discovery/terms/refuse.hpp"
#include "llmt/discovery/terms.hpp"

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

RowFilter::RowFilter(const Inputs& inputs) {
  const Rows rows = rows_of(inputs, Eigen::VectorXd::Zero(inputs.values.rows()));
  step_ = median_step(rows);
  constexpr double uneven = 0.5;  // steps
  for (std::size_t k = 0; k < rows.sequence.size(); ++k) {
    const double step = k == 0 ? 0.0 : rows.instants(rows.sequence[k]) - rows.instants(rows.sequence[k - 1]);
    if (k == 0 || !(std::abs(step - step_) < uneven * step_)) pieces_.emplace_back();
    pieces_.back().push_back(rows.sequence[k]);
  }
  stride_ = step_ > 0.0 ? independent_step(inputs.cutoff, step_) : 1;
  if (stride_ < 2) {
    refuse("find_missing",
           fmt::format("rows are {:.4g} apart, too far to filter the simulation at {:.4g} per unit of time "
                       "as the measured outputs were",
                       step_, inputs.cutoff));
  }
  weights_ = low_pass(inputs.cutoff, step_);
  crossings_ = std::make_shared<const std::vector<Crossing>>(crossings_of(inputs.values, pieces_));
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

Eigen::MatrixXd squared_errors_of_steps(const Inputs& inputs, const Eigen::MatrixXd& of_rows) {
  constexpr Eigen::Index fewest = 4;  // rows in an independent one, of which half are left
  constexpr double order = 3.0;       // 2^2 - 1
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(of_rows.rows(), of_rows.cols());
  const RowFilter filter(inputs);
  if (filter.stride() < fewest) return squares;
  std::vector<Eigen::Index> kept;
  std::vector<Eigen::Index> next;  // the row left out after it, or itself
  for (const std::vector<Eigen::Index>& piece : filter.pieces()) {
    for (std::size_t k = 0; k < piece.size(); k += 2) {
      kept.push_back(piece[k]);
      next.push_back(piece[std::min(k + 1, piece.size() - 1)]);
    }
  }
  Inputs half = inputs;
  half.values = inputs.values(kept, Eigen::all);
  half.instants = inputs.instants(kept);
  half.runs.clear();
  for (const Eigen::Index row : kept) {
    if (!inputs.runs.empty()) half.runs.push_back(inputs.runs[row]);
  }
  const Eigen::MatrixXd change = filter(of_rows)(kept, Eigen::all) - RowFilter(half)(of_rows(kept, Eigen::all));
  squares(kept, Eigen::all) = (change / order).cwiseAbs2();
  squares(next, Eigen::all) = squares(kept, Eigen::all).eval();
  return squares;
}

Eigen::MatrixXd as_measured(const Inputs& inputs, const Eigen::MatrixXd& of_rows) {
  return inputs.cutoff > 0.0 ? RowFilter(inputs)(of_rows) : of_rows;
}

}  // namespace llmt::discovery
