/// \file
/// Sums over the rows on the sides of a split.
#pragma once

#include <cstdint>
#include <span>

namespace llmt {

/// Sums over the rows on one side of a split: of weights w, of w e, w z, w z^2 and w z e.
struct SideSums {
  double weight = 0.0;
  double residual = 0.0;
  double z = 0.0;
  double zz = 0.0;
  double ze = 0.0;

  void add(double w, double e, double of_z) {
    weight += w;
    residual += w * e;
    z += w * of_z;
    zz += w * of_z * of_z;
    ze += w * of_z * e;
  }
  SideSums operator+(const SideSums& other) const {
    return {weight + other.weight, residual + other.residual, z + other.z, zz + other.zz, ze + other.ze};
  }
  SideSums operator-(const SideSums& other) const {
    return {weight - other.weight, residual - other.residual, z - other.z, zz - other.zz, ze - other.ze};
  }
};

/// Rows one after the other.
struct RowsInOrder {
  std::span<const double> weights;
  std::span<const double> residuals;
  std::span<const float> z;
};

/// The sums over all rows, as SideSums::add() forms them row by row.
SideSums sum_rows(const RowsInOrder& rows);

/// The sums over all rows and over those whose cell is below `first`.
struct SumsOfBoth {
  SideSums all;
  SideSums left;
};
SumsOfBoth sum_sides(const RowsInOrder& rows, std::span<const int> cells, int first);

}  // namespace llmt
