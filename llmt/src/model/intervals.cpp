#include "llmt/intervals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

#include "base/parallel.hpp"
#include "model/incomplete.hpp"
#include "model/interval_checks.hpp"

namespace llmt {
namespace {

using Residuals = std::vector<Eigen::MatrixXd>;  // of each fold, ascending, one column per output

Eigen::Index count_rows(const Residuals& residuals) {
  Eigen::Index rows = 0;
  for (const Eigen::MatrixXd& of_fold : residuals) rows += of_fold.rows();
  return rows;
}

// Number of values that lie outside the interval at either end: floor(a (n + 1)) with a = 1 - level.
Eigen::Index values_outside(double level, Eigen::Index rows) {
  constexpr double slack = 1.0 + 1e-12;  // keeps 0.1 * 30 from becoming 2
  return static_cast<Eigen::Index>(std::floor((1.0 - level) * static_cast<double>(rows + 1) * slack));
}

void check_level(double level, Eigen::Index rows) {
  if (!(level > 0.0 && level < 1.0)) {
    throw std::invalid_argument(fmt::format("llmt::Intervals: level is {}, it must lie between 0 and 1", level));
  }
  if (values_outside(level, rows) < 1) {
    throw std::invalid_argument(
        fmt::format("llmt::Intervals: level {} needs at least {:.0f} held-out rows, there are {}", level,
                    std::ceil(1.0 / (1.0 - level)) - 1.0, rows));
  }
}

// An interval of one output at one row.
struct Interval {
  double lower;
  double upper;
};

// Residuals that count alike, and how many of the outermost values lie beyond an end.
struct Calibration {
  std::vector<const Residuals*> parts;
  Eigen::Index rank;
};

// The calibrations whose intervals a row is given the hull of: that of its kind, or where the kind has too few rows
// that of all rows, and the outermost residuals of the kind.
std::vector<Calibration> calibrations_of(const Residuals& kind, const Residuals& others, double level) {
  const Eigen::Index rows = count_rows(kind);
  if (const Eigen::Index rank = values_outside(level, rows); rank >= 1) return {{{&kind}, rank}};
  std::vector<Calibration> result = {{{&kind, &others}, values_outside(level, rows + count_rows(others))}};
  if (rows > 0) result.push_back({{&kind}, 1});
  return result;
}

// `predicted`: of each fold's model.
Interval interval_at(const std::vector<Eigen::MatrixXd>& predicted, const Calibration& calibration, Eigen::Index row,
                     Eigen::Index output) {
  const Eigen::Index rank = calibration.rank;
  std::vector<double> lower;
  std::vector<double> upper;
  // Only the `rank` largest residuals of a fold can be among the `rank` outermost values.
  for (const Residuals* residuals : calibration.parts) {
    for (std::size_t k = 0; k < predicted.size(); ++k) {
      const Eigen::MatrixXd& of_fold = (*residuals)[k];
      for (Eigen::Index i = std::max<Eigen::Index>(0, of_fold.rows() - rank); i < of_fold.rows(); ++i) {
        lower.push_back(predicted[k](row, output) - of_fold(i, output));
        upper.push_back(predicted[k](row, output) + of_fold(i, output));
      }
    }
  }
  std::nth_element(lower.begin(), lower.begin() + (rank - 1), lower.end());
  std::nth_element(upper.begin(), upper.begin() + (rank - 1), upper.end(), std::greater<>());
  const Interval interval{lower[rank - 1], upper[rank - 1]};
  if (interval.lower <= interval.upper) return interval;
  // The folds' models disagree by more than their residuals.
  const double middle = 0.5 * (interval.lower + interval.upper);
  return {middle, middle};
}

// The hull of the intervals of all calibrations.
Interval hull_at(const std::vector<Eigen::MatrixXd>& predicted, const std::vector<Calibration>& calibrations,
                 Eigen::Index row, Eigen::Index output) {
  for (const Eigen::MatrixXd& of_fold : predicted) {
    if (std::isnan(of_fold(row, output))) return {std::nan(""), std::nan("")};
  }
  Interval hull = interval_at(predicted, calibrations.front(), row, output);
  for (std::size_t c = 1; c < calibrations.size(); ++c) {
    const Interval other = interval_at(predicted, calibrations[c], row, output);
    hull = {std::min(hull.lower, other.lower), std::max(hull.upper, other.upper)};
  }
  return hull;
}

// Throws std::invalid_argument if the residuals are not those of these models, and sorts them.
void check_and_sort(const std::vector<Model>& models, Residuals& residuals) {
  if (models.size() != residuals.size()) {
    throw std::invalid_argument(
        fmt::format("llmt::Intervals: {} models and {} matrices of residuals", models.size(), residuals.size()));
  }
  for (std::size_t k = 0; k < models.size(); ++k) {
    if (residuals[k].cols() != models[0].num_outputs()) {
      throw std::invalid_argument(fmt::format("llmt::Intervals: fold {} has {} columns of residuals for {} outputs", k,
                                              residuals[k].cols(), models[0].num_outputs()));
    }
    if (!residuals[k].allFinite() || (residuals[k].array() < 0.0).any()) {
      throw std::invalid_argument(fmt::format("llmt::Intervals: a residual of fold {} is negative or not finite", k));
    }
    for (Eigen::Index o = 0; o < residuals[k].cols(); ++o) {
      std::sort(residuals[k].col(o).begin(), residuals[k].col(o).end());
    }
  }
}

}  // namespace

Intervals::Intervals(std::vector<Model> models, std::vector<Eigen::MatrixXd> residuals,
                     std::vector<Eigen::MatrixXd> incomplete)
    : models_(std::move(models)), residuals_(std::move(residuals)), incomplete_(std::move(incomplete)) {
  for (std::size_t k = 0; k < models_.size(); ++k) {
    if (const std::string difference = difference_of_columns(models_[k], models_[0]); !difference.empty()) {
      throw std::invalid_argument(fmt::format("llmt::Intervals: fold {} and fold 0 differ: {}", k, difference));
    }
  }
  check_and_sort(models_, residuals_);
  if (incomplete_.empty() && !models_.empty()) {
    incomplete_.assign(models_.size(), Eigen::MatrixXd(0, models_[0].num_outputs()));
  }
  check_and_sort(models_, incomplete_);
}

Bounds Intervals::predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, double level, int max_threads) const {
  if (empty()) {
    throw std::invalid_argument(
        "llmt::Intervals: there are no held-out residuals; fit with folds and with FitOptions::intervals = true");
  }
  check_level(level, count_rows(residuals_) + count_rows(incomplete_));
  std::vector<Eigen::MatrixXd> predicted;
  for (const Model& model : models_) {
    predicted.push_back(model.predict(inputs, max_threads));
  }
  const std::vector<Calibration> of_complete = calibrations_of(residuals_, incomplete_, level);
  const std::vector<Calibration> of_incomplete = calibrations_of(incomplete_, residuals_, level);
  const std::vector<bool> incomplete = incomplete_rows(models_, inputs);
  const Eigen::Index outputs = predicted[0].cols();
  Bounds bounds{Eigen::MatrixXd(inputs.rows(), outputs), Eigen::MatrixXd(inputs.rows(), outputs)};
  constexpr Eigen::Index block = 256;
  parallel_for((inputs.rows() + block - 1) / block, max_threads, [&](Eigen::Index index) {
    for (Eigen::Index row = index * block; row < std::min(inputs.rows(), (index + 1) * block); ++row) {
      for (Eigen::Index o = 0; o < outputs; ++o) {
        const auto [lower, upper] = hull_at(predicted, incomplete[row] ? of_incomplete : of_complete, row, o);
        bounds.lower(row, o) = lower;
        bounds.upper(row, o) = upper;
      }
    }
  });
  const bool has_few = values_outside(level, count_rows(incomplete_)) < 1;
  for (Eigen::Index row = 0; has_few && row < inputs.rows(); ++row) {
    if (incomplete[row]) bounds.uncalibrated.push_back(row);
  }
  return bounds;
}

}  // namespace llmt
