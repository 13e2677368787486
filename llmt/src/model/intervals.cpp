#include "llmt/intervals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/parallel.hpp"
#include "model/interval_checks.hpp"

namespace llmt {
namespace {

// Number of values that lie outside the interval at either end: floor(a (n + 1)) with a = 1 - level.
Eigen::Index values_outside(double level, Eigen::Index rows) {
  if (!(level > 0.0 && level < 1.0)) {
    throw std::invalid_argument(fmt::format("llmt::Intervals: level is {}, it must lie between 0 and 1", level));
  }
  constexpr double slack = 1.0 + 1e-12;  // keeps 0.1 * 30 from becoming 2
  const Eigen::Index rank =
      static_cast<Eigen::Index>(std::floor((1.0 - level) * static_cast<double>(rows + 1) * slack));
  if (rank < 1) {
    throw std::invalid_argument(
        fmt::format("llmt::Intervals: level {} needs at least {:.0f} held-out rows, there are {}", level,
                    std::ceil(1.0 / (1.0 - level)) - 1.0, rows));
  }
  return rank;
}

// An interval of one output at one row.
struct Interval {
  double lower;
  double upper;
};

// `predicted`: of each fold's model; `residuals`: of each fold, ascending, one column per output.
Interval interval_at(const std::vector<Eigen::MatrixXd>& predicted, const std::vector<Eigen::MatrixXd>& residuals,
                     Eigen::Index row, Eigen::Index output, Eigen::Index rank) {
  std::vector<double> lower;
  std::vector<double> upper;
  // Only the `rank` largest residuals of a fold can be among the `rank` outermost values.
  for (std::size_t k = 0; k < predicted.size(); ++k) {
    if (std::isnan(predicted[k](row, output))) return {std::nan(""), std::nan("")};
    const Eigen::Index count = residuals[k].rows();
    for (Eigen::Index i = std::max<Eigen::Index>(0, count - rank); i < count; ++i) {
      lower.push_back(predicted[k](row, output) - residuals[k](i, output));
      upper.push_back(predicted[k](row, output) + residuals[k](i, output));
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

}  // namespace

Intervals::Intervals(std::vector<Model> models, std::vector<Eigen::MatrixXd> residuals)
    : models_(std::move(models)), residuals_(std::move(residuals)) {
  if (models_.size() != residuals_.size()) {
    throw std::invalid_argument(
        fmt::format("llmt::Intervals: {} models and {} matrices of residuals", models_.size(), residuals_.size()));
  }
  for (std::size_t k = 0; k < models_.size(); ++k) {
    if (const std::string difference = difference_of_columns(models_[k], models_[0]); !difference.empty()) {
      throw std::invalid_argument(fmt::format("llmt::Intervals: fold {} and fold 0 differ: {}", k, difference));
    }
    if (residuals_[k].cols() != models_[0].num_outputs()) {
      throw std::invalid_argument(fmt::format("llmt::Intervals: fold {} has {} columns of residuals for {} outputs", k,
                                              residuals_[k].cols(), models_[0].num_outputs()));
    }
    if (!residuals_[k].allFinite() || (residuals_[k].array() < 0.0).any()) {
      throw std::invalid_argument(fmt::format("llmt::Intervals: a residual of fold {} is negative or not finite", k));
    }
    for (Eigen::Index o = 0; o < residuals_[k].cols(); ++o) {
      std::sort(residuals_[k].col(o).begin(), residuals_[k].col(o).end());
    }
  }
}

Bounds Intervals::predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs, double level, int max_threads) const {
  if (empty()) {
    throw std::invalid_argument("llmt::Intervals: there are no held-out residuals; fit with folds");
  }
  Eigen::Index rows = 0;
  for (const Eigen::MatrixXd& residuals : residuals_) {
    rows += residuals.rows();
  }
  const Eigen::Index rank = values_outside(level, rows);
  std::vector<Eigen::MatrixXd> predicted;
  for (const Model& model : models_) {
    predicted.push_back(model.predict(inputs, max_threads));
  }
  Bounds bounds{Eigen::MatrixXd(inputs.rows(), predicted[0].cols()),
                Eigen::MatrixXd(inputs.rows(), predicted[0].cols())};
  constexpr Eigen::Index block = 256;
  parallel_for((inputs.rows() + block - 1) / block, max_threads, [&](Eigen::Index index) {
    for (Eigen::Index row = index * block; row < std::min(inputs.rows(), (index + 1) * block); ++row) {
      for (Eigen::Index o = 0; o < predicted[0].cols(); ++o) {
        const auto [lower, upper] = interval_at(predicted, residuals_, row, o, rank);
        bounds.lower(row, o) = lower;
        bounds.upper(row, o) = upper;
      }
    }
  });
  return bounds;
}

}  // namespace llmt
