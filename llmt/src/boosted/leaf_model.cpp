#include "boosted/leaf_model.hpp"

#include <algorithm>
#include <cmath>

namespace llmt {
namespace {

using SquareOfSlopes = std::array<Slopes, most_boosted_slopes>;

// Solves the positive definite system a x = b in place of b (Cholesky).
void solve(SquareOfSlopes& a, Slopes& b, int size) {
  for (int j = 0; j < size; ++j) {
    for (int k = 0; k < j; ++k) {
      for (int i = j; i < size; ++i) a[i][j] -= a[i][k] * a[j][k];
    }
    const double root = std::sqrt(std::max(a[j][j], 1e-12));
    for (int i = j; i < size; ++i) a[i][j] /= root;
  }
  for (int i = 0; i < size; ++i) {
    for (int k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (int i = size - 1; i >= 0; --i) {
    for (int k = i + 1; k < size; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
}

}  // namespace

void add_estimate(LeafModel& model, int slopes, const RegressorSums& sums, const Ridges& ridges) {
  auto [n, s, low, high, mean, ze, zz] = sums;
  for (int j = 0; j < slopes; ++j) mean[j] /= n;
  for (int j = 0; j < slopes; ++j) {
    ze[j] -= mean[j] * s;
    for (int i = j; i < slopes; ++i) zz[i][j] -= n * mean[i] * mean[j];
    zz[j][j] += ridges.slope;
  }
  solve(zz, ze, slopes);
  model.constant += s / (n + ridges.constant);
  double middle = model.constant;
  for (int j = 0; j < slopes; ++j) {
    model.constant -= ze[j] * mean[j];
    model.slopes[j] += ze[j];
  }
  for (int j = 0; j < slopes; ++j) middle += (model.slopes[j] - ze[j]) * mean[j];
  if (low > high) low = high = middle;
  const double margin = 0.1 * (high - low);
  model.low = std::min(low - margin, middle);
  model.high = std::max(high + margin, middle);
}

SideModel side_model(const SideSums& side, bool has_slope, const Ridges& ridges) {
  const auto [n, s, z, zz, ze] = side;
  if (n == 0.0) return {};
  const double slope = has_slope ? (ze - z * s / n) / (std::max(0.0, zz - z * z / n) + ridges.slope) : 0.0;
  return {s / (n + ridges.constant) - slope * z / n, slope};
}

}  // namespace llmt
