#include "discovery/recording/speeds.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "discovery/signals/kernel.hpp"

namespace llmt::discovery {
namespace {

// The linear map from position, speed and acceleration at the rows of a window to the speed at one of them.
class LocalSpeed {
 public:
  // `times` from the row, in the unit of the speed; `errors`: standard deviations of the three.
  LocalSpeed(Eigen::VectorXd times, const Eigen::Array3d& errors) {
    constexpr Eigen::Index powers = 6;
    const Eigen::Index n = times.size();
    const double width = times.cwiseAbs().maxCoeff();
    times /= width;
    Eigen::MatrixXd weighted = Eigen::MatrixXd::Zero(3 * n, powers);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index p = 0; p < powers; ++p) {
        const auto q = static_cast<double>(p);
        weighted(i, p) = std::pow(times(i), q) / errors(0);
        if (p > 0) weighted(n + i, p) = q * std::pow(times(i), q - 1.0) / width / errors(1);
        if (p > 1) weighted(2 * n + i, p) = q * (q - 1.0) * std::pow(times(i), q - 2.0) / (width * width) / errors(2);
      }
    }
    const Eigen::RowVectorXd scales = weighted.colwise().norm();
    weighted.array().rowwise() /= scales.array();
    const Eigen::LDLT<Eigen::MatrixXd> gram(weighted.transpose() * weighted);
    inverse_ = gram.solve(weighted.transpose());
    speed_ = scales(1) * width;
    error_ = inverse_.row(1).norm() / speed_;
    weighted_ = std::move(weighted);
  }

  // Of a window n x 3, in units of the errors; none where the three are no polynomial within their errors, as where the
  // acceleration jumps.
  std::optional<double> operator()(const Eigen::MatrixXd& window) const {
    const Eigen::VectorXd values = window.reshaped();
    const Eigen::VectorXd coefficients = inverse_ * values;
    const auto dof = static_cast<double>(values.size() - coefficients.size());
    constexpr double surprising = 3.0;  // standard deviations of chi^2
    const double chi_squared = (values - weighted_ * coefficients).squaredNorm();
    if (chi_squared > dof + surprising * std::sqrt(2.0 * dof)) return {};
    return coefficients(1) / speed_;
  }
  double error() const { return error_; }

 private:
  Eigen::MatrixXd weighted_;
  Eigen::MatrixXd inverse_;
  double speed_ = 1.0;
  double error_ = 0.0;
};

struct Speed {
  Eigen::VectorXd values;
  std::vector<bool> is_smooth;
  double error = 0.0;  // root mean square of those that are
};

// Of rows that are not smooth yet, over `half` rows before and after each.
void smooth_speed(const Rows& rows, const Eigen::MatrixXd& motion, const Eigen::Array3d& errors, double second,
                  Eigen::Index half, Speed& speed) {
  const std::vector<Recorded> recorded = recordings(rows);
  Eigen::VectorXd before;
  std::optional<LocalSpeed> local;
  for (Eigen::Index k = 0; k < std::ssize(rows.sequence); ++k) {
    const Eigen::Index row = rows.sequence[k];
    const Eigen::Index begin = std::max(recorded[k].begin, k - half);
    const Eigen::Index end = std::min(recorded[k].end, k + half + 1);
    if (speed.is_smooth[row] || end - begin < half + 1) continue;
    Eigen::VectorXd times(end - begin);
    Eigen::MatrixXd window(end - begin, 3);
    for (Eigen::Index i = begin; i < end; ++i) {
      times(i - begin) = (rows.instants(rows.sequence[i]) - rows.instants(row)) / second;
      window.row(i - begin) = motion.row(rows.sequence[i]).cwiseQuotient(errors.matrix().transpose());
    }
    if (before.size() != times.size() ||
        (before - times).cwiseAbs().maxCoeff() > same_time * times.cwiseAbs().maxCoeff()) {
      local.emplace(times, errors);
      before = times;
    }
    const std::optional<double> value = (*local)(window);
    if (!value) continue;
    speed.values(row) = *value;
    speed.is_smooth[row] = true;
    speed.error += local->error() * local->error();
  }
}

// The factor that speeds as measured have of those that are smooth.
double factor_of(const Speed& speed, const Eigen::VectorXd& measured) {
  double common = 0.0;
  double own = 0.0;
  for (Eigen::Index i = 0; i < measured.size(); ++i) {
    if (!speed.is_smooth[i]) continue;
    common += speed.values(i) * measured(i);
    own += speed.values(i) * speed.values(i);
  }
  return own > 0.0 ? common / own : 1.0;
}

// Windows are narrower where an acceleration jumps. `second` is an estimate from noisy signals, so it is refined once.
Speed smooth_speed(const Rows& rows, const Eigen::MatrixXd& motion, const Eigen::Array3d& errors, double second,
                   Eigen::Index lag) {
  constexpr Eigen::Index narrowest = 3;
  Speed speed;
  for (const bool is_last : {false, true}) {
    speed = {motion.col(1), std::vector<bool>(motion.rows(), false), 0.0};
    for (Eigen::Index half = std::max(lag, narrowest); half >= narrowest; half /= 2) {
      smooth_speed(rows, motion, errors, second, half, speed);
      if (!is_last) break;
    }
    const double factor = factor_of(speed, motion.col(1));
    second *= factor;
    for (Eigen::Index i = 0; i < motion.rows(); ++i) {
      if (speed.is_smooth[i]) speed.values(i) *= factor;
    }
  }
  const auto count = static_cast<double>(std::ranges::count(speed.is_smooth, true));
  speed.error = count > 0.0 ? std::sqrt(speed.error / count) : errors(1);
  return speed;
}

}  // namespace

SmoothedInputs smoothed(const Recording& recording, const Eigen::MatrixXd& simulated) {
  const Inputs& inputs = recording.inputs();
  const Eigen::Index n = inputs.values.rows();
  SmoothedInputs result{.recording = recording,
                        .errors = Eigen::VectorXd::Zero(inputs.values.cols()),
                        .change = {},
                        .unknown_sign = {},
                        .notes = {}};
  // What has the wrong shape is refused by the search.
  // Speeds of one filter are as good as they get.
  if (!recording.is_in_time() || recording.is_filtered() || n < fewest_for_derivatives || simulated.rows() != n ||
      !simulated.allFinite())
    return result;
  const std::shared_ptr<const Surrogate> surrogate = recording.surrogate(simulated);
  if (surrogate->described().minCoeff() < well_described) return result;
  const Eigen::MatrixXd& covariance = recording.covariance();
  Inputs better_inputs = inputs;
  std::vector<bool> unknown_sign(n, false);
  for (const Motion& motion : recording.axes()) {
    const std::array<Eigen::Index, 3> columns = {motion.position, motion.speed, motion.acceleration};
    Eigen::MatrixXd own(n, 3);
    Eigen::Array3d errors;
    for (Eigen::Index k = 0; k < 3; ++k) {
      own.col(k) = inputs.values.col(columns[k]);
      // A signal without errors is as good as its digits.
      const double spread = std::sqrt((own.col(k).array() - own.col(k).mean()).square().mean());
      errors(k) = std::max(std::sqrt(covariance(columns[k], columns[k])), digits_of_a_file * spread);
    }
    const Speed better = smooth_speed(recording.rows(), own, errors, motion.second, recording.lag());
    constexpr double a_third = 1.0 / 3.0;
    constexpr double more = 1.1;
    const double taken_off = std::sqrt((better.values - own.col(1)).squaredNorm() / static_cast<double>(n));
    const auto rough = static_cast<double>(std::ranges::count(better.is_smooth, false));
    constexpr double most_rough = 0.5;
    if (!(better.error <= a_third * errors(1)) || taken_off > more * errors(1) ||
        rough > most_rough * static_cast<double>(n)) {
      continue;
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!better.is_smooth[i] && std::abs(own(i, 1)) < hides_the_sign * errors(1)) unknown_sign[i] = true;
    }
    better_inputs.values.col(motion.speed) = better.values;
    result.errors(motion.speed) = errors(1);
    if (better_inputs.noise.size() > 0) better_inputs.noise(motion.speed) = better.error;
    result.notes.push_back(fmt::format(
        "{} was smoothed, as the derivative of {} by time: standard deviation of its errors {:.2g} -> {:.2g}",
        inputs.names[motion.speed], inputs.names[motion.position], errors(1), better.error));
  }
  if (result.notes.empty()) return result;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (unknown_sign[i]) result.unknown_sign.push_back(i);
  }
  result.change = surrogate->predict(better_inputs.values) - surrogate->predict(inputs.values);
  result.recording = Recording(std::move(better_inputs));
  return result;
}

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
