#include "discovery/terms/standstill.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "discovery/signals/kernel.hpp"
#include "discovery/terms/derivatives.hpp"
#include "discovery/terms/motion.hpp"
#include "discovery/terms/row_split.hpp"
#include "llmt/discovery/terms.hpp"

namespace llmt::discovery {
namespace {

// Squares of the fourth differences that are centred at each row; negative where there is none.
Eigen::VectorXd roughness(const Rows& rows, const Eigen::VectorXd& values) {
  const std::vector<Recorded> recorded = recordings(rows);
  const auto n = std::ssize(rows.sequence);
  Eigen::VectorXd squares = Eigen::VectorXd::Constant(n, -1.0);
  for (Eigen::Index k = 2; k + 2 < n; ++k) {
    if (recorded[k - 2].begin != recorded[k + 2].begin) continue;
    const auto at = [&](Eigen::Index i) { return values(rows.sequence[k + i]); };
    const double difference = at(-2) - 4.0 * at(-1) + 6.0 * at(0) - 4.0 * at(1) + at(2);
    squares(rows.sequence[k]) = difference * difference;
  }
  return squares;
}

void keep(const Samples& from, const std::vector<bool>& apart, Samples& to, std::vector<bool>& kept) {
  for (Eigen::Index i = 0; i < from.size(); ++i) {
    if (from.is_filtered()) {
      // Next to nothing of what is set apart may be in what is computed.
      constexpr double negligible = 0.02;
      double share = 0.0;
      for (Eigen::Index k = 0; k < from.weights().size(); ++k) {
        if (apart[from.around(i)[k]]) share += std::abs(from.weights()(k));
      }
      kept.push_back(!apart[from.rows_of(i).front()] && share <= negligible);
      if (kept.back()) to.add(from, i);
      continue;
    }
    const std::span<const Eigen::Index> all = from.rows_of(i);
    std::vector<Eigen::Index> left;
    std::ranges::copy_if(all, std::back_inserter(left), [&](Eigen::Index row) { return !apart[row]; });
    kept.push_back(2 * left.size() >= all.size() && !left.empty());
    if (kept.back()) to.add(left);
  }
}

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
void keep_speeds(const Inputs& inputs, Eigen::VectorXd& bands) {
  if (!(bands.array() > 0.0).any()) return;
  const Rows rows = rows_of(inputs, Eigen::VectorXd::Zero(inputs.values.rows()));
  constexpr Eigen::Index lags = 2;
  for (const Motion& motion : motions(Derivatives(rows, lags * smooth_lag(rows, inputs.values)), inputs)) {
    bands(motion.position) = 0.0;
    bands(motion.acceleration) = 0.0;
  }
}

}  // namespace

Eigen::VectorXd zero_bands(const Inputs& inputs, const Eigen::MatrixXd& deviations) {
  const Eigen::Index p = inputs.values.cols();
  Eigen::VectorXd dense = Eigen::VectorXd::Zero(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    const Eigen::VectorXd x = inputs.values.col(j);
    if (x.minCoeff() < 0.0 && x.maxCoeff() > 0.0 && is_smooth_in_time(inputs, j)) dense(j) = band_of(x);
  }
  keep_speeds(inputs, dense);
  double stride = 1.0;
  if (inputs.cutoff > 0.0) {
    const double step = median_step(rows_of(inputs, Eigen::VectorXd::Zero(inputs.values.rows())));
    if (step > 0.0) stride = static_cast<double>(independent_step(inputs.cutoff, step));
  }
  // Axes that stop together jump together: the surest is taken, and the others are looked at beside it.
  Inputs rests = inputs;
  rests.zero_bands = Eigen::VectorXd::Zero(p);
  Eigen::MatrixXd signs(inputs.values.rows(), 0);
  for (;;) {
    constexpr double surprising = 4.0;
    double surest = surprising;
    Eigen::Index next = -1;
    const std::vector<bool> apart = rows_at_rest(rests);
    for (Eigen::Index j = 0; j < p; ++j) {
      if (!(dense(j) > 0.0) || rests.zero_bands(j) > 0.0) continue;
      for (Eigen::Index o = 0; o < deviations.cols(); ++o) {
        const double jump = jump_of(inputs.values.col(j), deviations.col(o), dense(j), apart, signs, stride);
        if (jump > surest) {
          surest = jump;
          next = j;
        }
      }
    }
    if (next < 0) return rests.zero_bands;
    rests.zero_bands(next) = dense(next);
    signs.conservativeResize(Eigen::NoChange, signs.cols() + 1);
    signs.rightCols(1) = inputs.values.col(next).cwiseSign();
  }
}

std::vector<bool> rows_at_rest(const Inputs& inputs) {
  std::vector<bool> at_rest(inputs.values.rows(), false);
  for (Eigen::Index j = 0; j < inputs.zero_bands.size(); ++j) {
    for (Eigen::Index i = 0; i < inputs.values.rows(); ++i) {
      if (std::abs(inputs.values(i, j)) < inputs.zero_bands(j)) at_rest[i] = true;
    }
  }
  return at_rest;
}

std::vector<UnknownSign> rows_of_unknown_sign(const Rows& rows, const Inputs& inputs, const Eigen::MatrixXd& covariance,
                                              const Eigen::MatrixXd& deviations, std::vector<bool>& apart) {
  constexpr double errors = 3.0;
  constexpr double rougher = 2.5;
  constexpr double fewest = 8.0;
  constexpr double largest_share = 0.3;
  std::vector<UnknownSign> found;
  for (Eigen::Index j = 0; j < inputs.values.cols(); ++j) {
    const Eigen::VectorXd x = inputs.values.col(j);
    const double limit = errors * std::sqrt(covariance(j, j));
    if (!(limit > 0.0) || x.minCoeff() >= 0.0 || x.maxCoeff() <= 0.0) continue;
    UnknownSign own{inputs.names[j], limit, (x.array().abs() < limit).count(), 0.0};
    if (static_cast<double>(own.rows) > largest_share * static_cast<double>(x.size())) continue;
    for (Eigen::Index o = 0; o < deviations.cols(); ++o) {
      const Eigen::VectorXd squares = roughness(rows, deviations.col(o));
      double below = 0.0;
      double count = 0.0;
      std::vector<double> above;
      for (Eigen::Index i = 0; i < x.size(); ++i) {
        if (squares(i) < 0.0 || apart[i]) continue;
        if (std::abs(x(i)) < limit) {
          below += squares(i);
          count += 1.0;
        } else {
          above.push_back(squares(i));
        }
      }
      if (count < fewest || static_cast<double>(above.size()) < fewest) continue;
      double sum = 0.0;
      for (const double value : above) sum += value;
      const double mean = sum / static_cast<double>(above.size());
      if (mean > 0.0) own.roughness = std::max(own.roughness, below / count / mean);
    }
    if (own.roughness < rougher) continue;
    for (Eigen::Index i = 0; i < x.size(); ++i) apart[i] = apart[i] || std::abs(x(i)) < limit;
    own.roughness = std::sqrt(own.roughness);
    found.push_back(own);
  }
  return found;
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

std::vector<std::string> notes_on_rest(const Inputs& inputs) {
  std::vector<std::string> notes;
  for (Eigen::Index j = 0; j < inputs.zero_bands.size(); ++j) {
    if (!(inputs.zero_bands(j) > 0.0)) continue;
    notes.push_back(fmt::format(
        "{0} rests at {1} rows, with |{0}| < {2:.3g}. They were set apart, because dry friction at rest may be "
        "anything up to that of motion. The terms found take {0} for 0 where |{0}| < {3:.3g}",
        inputs.names[j], (inputs.values.col(j).array().abs() < inputs.zero_bands(j)).count(), inputs.zero_bands(j),
        bands_of_errors(inputs)(j)));
  }
  return notes;
}

RowSplit without_rows(const RowSplit& split, const std::vector<bool>& apart) {
  RowSplit result = split;
  result.searched = {};
  result.held_out = {};
  result.repeats.clear();
  result.stretches.clear();
  std::vector<bool> kept;
  keep(split.searched, apart, result.searched, kept);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!kept[i]) continue;
    if (!split.repeats.empty()) result.repeats.push_back(split.repeats[i]);
    if (!split.stretches.empty()) result.stretches.push_back(split.stretches[i]);
  }
  keep(split.held_out, apart, result.held_out, kept);
  return result;
}

}  // namespace llmt::discovery
