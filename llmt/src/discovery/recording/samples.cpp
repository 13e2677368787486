#include "discovery/recording/samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "discovery/recording/derivatives.hpp"
#include "discovery/recording/refuse.hpp"
#include "discovery/signals/kernel.hpp"

namespace llmt::discovery {

Eigen::VectorXd jumping_at(const std::vector<Crossing>& crossings, Eigen::VectorXd of_rows) {
  std::vector<double> jumps;
  for (const Crossing& own : crossings) {
    const auto at = [&](std::size_t k) { return of_rows(own.rows[k]); };
    jumps.push_back(own.shift * (1.5 * (at(2) - at(1)) - 0.5 * (at(3) - at(0))));
  }
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    of_rows(crossings[k].rows[1]) += 0.5 * jumps[k];
    of_rows(crossings[k].rows[2]) += 0.5 * jumps[k];
  }
  return of_rows;
}

Eigen::MatrixXd means(const Eigen::MatrixXd& of_rows, const Samples& samples) {
  if (!samples.is_filtered()) return means_of_filtered(of_rows, samples);
  Eigen::MatrixXd result(samples.size(), of_rows.cols());
  const Eigen::VectorXd& weights = samples.weights();
  for (Eigen::Index c = 0; c < of_rows.cols(); ++c) {
    const Eigen::VectorXd column = samples.crossings() != nullptr ? jumping_at(*samples.crossings(), of_rows.col(c))
                                                                  : Eigen::VectorXd(of_rows.col(c));
    for (Eigen::Index i = 0; i < samples.size(); ++i) {
      const std::span<const Eigen::Index> around = samples.around(i);
      // Rows stand in the order of time in nearly all tables.
      if (around.back() - around.front() + 1 == weights.size()) {
        result(i, c) = weights.dot(column.segment(around.front(), weights.size()));
        continue;
      }
      double sum = 0.0;
      for (Eigen::Index k = 0; k < weights.size(); ++k) sum += weights(k) * column(around[k]);
      result(i, c) = sum;
    }
  }
  return result;
}

Eigen::MatrixXd means_of_filtered(const Eigen::MatrixXd& of_rows, const Samples& samples) {
  Eigen::MatrixXd result(samples.size(), of_rows.cols());
  for (Eigen::Index c = 0; c < of_rows.cols(); ++c) {
    for (Eigen::Index i = 0; i < samples.size(); ++i) {
      const std::span<const Eigen::Index> rows = samples.rows_of(i);
      double sum = 0.0;
      for (const Eigen::Index row : rows) sum += of_rows(row, c);
      result(i, c) = rows.size() == 1 ? sum : sum / static_cast<double>(rows.size());
    }
  }
  return result;
}

double share_kept(const Eigen::VectorXd& of_rows, const Eigen::VectorXd& kept, const Samples& samples) {
  if (std::ssize(samples.rows()) == samples.size() && !samples.is_filtered()) return 1.0;
  const Eigen::VectorXd rows = of_rows(samples.rows());
  const double all = (rows.array() - rows.mean()).square().mean();
  return all > 0.0 ? (kept.array() - kept.mean()).square().mean() / all : 1.0;
}

double carriers(const Eigen::VectorXd& of_samples) {
  const Eigen::ArrayXd squares = (of_samples.array() - of_samples.mean()).square();
  const double sum = squares.sum();
  return sum > 0.0 ? sum * sum / squares.square().sum() : 0.0;
}

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
  cutoff_ = cutoff;
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

Eigen::Vector3d RowFilter::uncorrelated_neighbours() const {
  return discovery::uncorrelated_neighbours(cutoff_, step_, stride_);
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
