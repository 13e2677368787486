#include "discovery/recording/standstill.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "discovery/signals/kernel.hpp"

namespace llmt::discovery {
namespace {

// The widest band of at most half of the rows, in which they lie clearly denser than where x passes; 0: none. A signal
// that passes 0 spends as long in any interval there as in another of the same width.
double band_of(const Eigen::VectorXd& x) {
  constexpr Eigen::Index fewest = 20;
  constexpr Eigen::Index fewest_beside = 5;
  constexpr double denser = 3.0;
  constexpr double finer = 1.25;
  constexpr double largest_share = 0.5;
  std::vector<double> sizes(x.size());
  Eigen::VectorXd::Map(sizes.data(), x.size()) = x.cwiseAbs();
  std::ranges::sort(sizes);
  const auto below = [&](double limit) {
    return static_cast<double>(std::ranges::lower_bound(sizes, limit) - sizes.begin());
  };
  // Root mean squares. Where x passes is looked at from `near` to `far`.
  const double spread = std::sqrt(x.squaredNorm() / static_cast<double>(x.size()));
  constexpr double near = 0.2;
  constexpr double far = 0.5;
  constexpr double widest = 0.1;
  constexpr double narrowest = 1e-6;
  const double passing = (below(far * spread) - below(near * spread)) / ((far - near) * spread);
  for (double band = widest * spread; band > narrowest * spread; band /= finer) {
    const double outer = below(band) - below(0.5 * band);
    if (below(band) > largest_share * static_cast<double>(x.size())) continue;
    if (outer >= fewest_beside && outer >= denser * passing * 0.5 * band && below(band) >= fewest &&
        below(band) >= denser * passing * band) {
      return band;
    }
  }
  return 0.0;
}

// How surely values jump where x passes the band, in standard errors: least squares of those at the next rows on both
// sides on 1, x, sgn x and the signs of other inputs. One row of `stride` is independent of the others.
double jump_of(const Eigen::VectorXd& x, const Eigen::VectorXd& values, double band, const std::vector<bool>& apart,
               const Eigen::MatrixXd& signs, double stride) {
  constexpr double share_of_rows = 0.1;  // on each side
  const auto next = static_cast<std::size_t>(share_of_rows * static_cast<double>(x.size()));
  constexpr std::size_t fewest = 10;
  std::vector<Eigen::Index> rows;
  for (const double side : {-1.0, 1.0}) {
    std::vector<std::pair<double, Eigen::Index>> beyond;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      if (side * x(i) >= band && !apart[i]) beyond.emplace_back(side * x(i), i);
    }
    if (beyond.size() < fewest) return 0.0;
    std::ranges::sort(beyond);
    beyond.resize(std::min(beyond.size(), next));
    for (const auto& [size, row] : beyond) rows.push_back(row);
  }
  Eigen::MatrixXd columns(std::ssize(rows), 3 + signs.cols());
  columns << x(rows).cwiseSign(), Eigen::VectorXd::Ones(std::ssize(rows)), x(rows), signs(rows, Eigen::all);
  const Eigen::VectorXd here = values(rows);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  if (qr.rank() < columns.cols() || here.size() <= columns.cols()) return 0.0;
  const Eigen::VectorXd fit = qr.solve(here);
  const double variance = (here - columns * fit).squaredNorm() / static_cast<double>(here.size() - columns.cols());
  const double inverse = (columns.transpose() * columns).ldlt().solve(Eigen::VectorXd::Unit(columns.cols(), 0))(0);
  constexpr double rounding = 1e-9;
  if (std::abs(fit(0)) <= rounding * here.cwiseAbs().maxCoeff()) return 0.0;
  return std::abs(fit(0)) / std::max(std::sqrt(stride * variance * inverse), std::numeric_limits<double>::min());
}

// A machine at rest has no speed. It may be anywhere, and its acceleration is 0 at a steady speed too.
void keep_speeds(const Recording& recording, Eigen::VectorXd& bands) {
  if (!(bands.array() > 0.0).any()) return;
  for (const Motion& motion : recording.axes()) {
    bands(motion.position) = 0.0;
    bands(motion.acceleration) = 0.0;
  }
}

// The rows at which an input is within its band.
std::vector<bool> rows_within(const Eigen::MatrixXd& values, const Eigen::VectorXd& bands) {
  std::vector<bool> within(values.rows(), false);
  for (Eigen::Index j = 0; j < bands.size(); ++j) {
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      if (std::abs(values(i, j)) < bands(j)) within[i] = true;
    }
  }
  return within;
}

}  // namespace

Eigen::VectorXd zero_bands(const Recording& recording, const Eigen::MatrixXd& deviations) {
  const Inputs& inputs = recording.inputs();
  const Eigen::Index p = inputs.values.cols();
  Eigen::VectorXd dense = Eigen::VectorXd::Zero(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    const Eigen::VectorXd x = inputs.values.col(j);
    if (x.minCoeff() < 0.0 && x.maxCoeff() > 0.0 && recording.is_smooth(j)) dense(j) = band_of(x);
  }
  keep_speeds(recording, dense);
  double stride = 1.0;
  if (inputs.cutoff > 0.0) {
    const double step = median_step(recording.rows());
    if (step > 0.0) stride = static_cast<double>(independent_step(inputs.cutoff, step));
  }
  // Axes that stop together jump together: the surest is taken, and the others are looked at beside it.
  Eigen::VectorXd bands = Eigen::VectorXd::Zero(p);
  Eigen::MatrixXd signs(inputs.values.rows(), 0);
  for (;;) {
    constexpr double surprising = 4.0;
    double surest = surprising;
    Eigen::Index next = -1;
    const std::vector<bool> apart = rows_within(inputs.values, bands);
    for (Eigen::Index j = 0; j < p; ++j) {
      if (!(dense(j) > 0.0) || bands(j) > 0.0) continue;
      for (Eigen::Index o = 0; o < deviations.cols(); ++o) {
        const double jump = jump_of(inputs.values.col(j), deviations.col(o), dense(j), apart, signs, stride);
        if (jump > surest) {
          surest = jump;
          next = j;
        }
      }
    }
    if (next < 0) return bands;
    bands(next) = dense(next);
    signs.conservativeResize(Eigen::NoChange, signs.cols() + 1);
    signs.rightCols(1) = inputs.values.col(next).cwiseSign();
  }
}

Eigen::VectorXd bands_of_errors(const Inputs& inputs) {
  constexpr double far = 4.0;  // standard deviations: farther out a machine that creeps moves
  Eigen::VectorXd bands = inputs.zero_bands;
  if (!(inputs.cutoff > 0.0) || inputs.noise.size() == 0) return bands;
  for (Eigen::Index j = 0; j < bands.size(); ++j) {
    if (inputs.noise(j) >= 0.0) bands(j) = std::min(bands(j), far * inputs.noise(j));
  }
  return bands;
}

}  // namespace llmt::discovery
