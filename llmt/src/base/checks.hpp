/// \file
/// Checks of arguments. All throw std::invalid_argument that names function, argument, place and value.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace llmt {

/// Checks that all entries of a matrix are finite.
inline void check_finite(const char* function, const char* argument, const Eigen::Ref<const Eigen::MatrixXd>& values) {
  if (values.allFinite()) return;
  for (Eigen::Index column = 0; column < values.cols(); ++column) {
    for (Eigen::Index row = 0; row < values.rows(); ++row) {
      if (!std::isfinite(values(row, column))) {
        throw std::invalid_argument(
            fmt::format("{}: {}({}, {}) is {}, it must be finite (rows and columns counted from 0)", function, argument,
                        row, column, values(row, column)));
      }
    }
  }
}

/// As check_finite(), but NaN stands for a missing value.
inline void check_finite_or_missing(const char* function, const char* argument,
                                    const Eigen::Ref<const Eigen::MatrixXd>& values) {
  if ((values.array().isNaN() || values.array().isFinite()).all()) return;
  for (Eigen::Index column = 0; column < values.cols(); ++column) {
    for (Eigen::Index row = 0; row < values.rows(); ++row) {
      if (std::isinf(values(row, column))) {
        throw std::invalid_argument(
            fmt::format("{}: {}({}, {}) is {}, it must be finite, or NaN where it is missing (rows and columns counted "
                        "from 0)",
                        function, argument, row, column, values(row, column)));
      }
    }
  }
}

/// Checks that every column is in [0, count) and that none is named twice.
inline void check_columns(const char* function, const char* argument, const std::vector<int>& columns,
                          Eigen::Index count) {
  std::vector<bool> seen(count, false);
  for (const int column : columns) {
    if (column < 0 || column >= count) {
      throw std::invalid_argument(
          fmt::format("{}: {} names column {}, there are {}", function, argument, column, count));
    }
    if (seen[column]) {
      throw std::invalid_argument(fmt::format("{}: {} names column {} twice", function, argument, column));
    }
    seen[column] = true;
  }
}

/// Checks that a time limit is a finite number of seconds above 0.
inline void check_seconds(const char* function, double seconds) {
  if (std::isfinite(seconds) && seconds > 0.0) return;
  throw std::invalid_argument(
      fmt::format("{}: a time limit of {} s, it must be finite and above 0", function, seconds));
}

}  // namespace llmt
