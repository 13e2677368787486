#include "discovery/signals/stretches.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

namespace llmt::discovery {
namespace {

constexpr double gap = 2.5;           // median steps
constexpr double unequal = 0.5;       // deviation of a step from the median step that counts as unequal
constexpr double most_unequal = 0.1;  // share of the steps
constexpr double equal = 1e-3;        // steps; deviations of times from equal spacing that are nothing but digits

bool same_run(const Log& log, Eigen::Index a, Eigen::Index b) { return log.runs.empty() || log.runs[a] == log.runs[b]; }

// The largest power of ten, up to 1 s, that all times of the part are multiples of; 0 if there is none down to 1 ns.
double resolution_of(const Eigen::Ref<const Eigen::VectorXd>& time) {
  for (int digits = 0; digits <= 9; ++digits) {
    const double scale = std::pow(10.0, digits);
    const Eigen::ArrayXd scaled = time.array() * scale;
    if (((scaled - scaled.round()).abs() <= 4e-16 * scaled.abs() + 1e-6).all()) return 1.0 / scale;
  }
  return 0.0;
}

// Cubic through the four samples around `t`, of which `left` is the last that is not later.
Eigen::RowVectorXd interpolated(const Eigen::VectorXd& time, const Eigen::MatrixXd& values, Eigen::Index left,
                                const Part& part, double t) {
  const Eigen::Index begin = std::clamp<Eigen::Index>(left - 1, part.first, part.last - 3);
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(values.cols());
  for (Eigen::Index i = begin; i < begin + 4; ++i) {
    double weight = 1.0;
    for (Eigen::Index j = begin; j < begin + 4; ++j) {
      if (j != i) weight *= (t - time(j)) / (time(i) - time(j));
    }
    sum += weight * values.row(i);
  }
  return sum;
}

}  // namespace

void check_log(const Log& log) {
  const Eigen::Index n = log.time.size();
  if (n == 0) throw LogError("the log has no rows", -1);
  if (log.positions.rows() != n || (log.torques.cols() > 0 && log.torques.rows() != n) ||
      (!log.runs.empty() && std::ssize(log.runs) != n)) {
    throw LogError(fmt::format("time has {} rows, positions {}, torques {}, runs {}", n, log.positions.rows(),
                               log.torques.rows(), log.runs.size()),
                   -1);
  }
  if (log.positions.cols() == 0) throw LogError("no positions", -1);
  for (Eigen::Index i = 0; i < n; ++i) {
    const bool finite = std::isfinite(log.time(i)) && log.positions.row(i).allFinite() &&
                        (log.torques.cols() == 0 || log.torques.row(i).allFinite());
    if (!finite) throw LogError("a value is not finite", i);
    // Sums of squares of weighted samples stay finite.
    constexpr double largest = 1e100;
    if (log.positions.row(i).cwiseAbs().maxCoeff() > largest ||
        (log.torques.cols() > 0 && log.torques.row(i).cwiseAbs().maxCoeff() > largest) ||
        std::abs(log.time(i)) > largest) {
      throw LogError(fmt::format("a value is larger than {}", largest), i);
    }
  }
}

Timing timing_of(const Log& log) {
  const Eigen::Index n = log.time.size();
  std::vector<double> steps;
  std::set<std::string> seen;
  if (!log.runs.empty()) seen.insert(log.runs.front());
  for (Eigen::Index i = 1; i < n; ++i) {
    if (!same_run(log, i - 1, i)) {
      if (!seen.insert(log.runs[i]).second) {
        throw LogError(fmt::format("run \"{}\" is there twice; the rows of a run must stand together", log.runs[i]), i);
      }
      continue;
    }
    const double step = log.time(i) - log.time(i - 1);
    if (step <= 0.0) {
      throw LogError(fmt::format("time is {} after {}, must increase{}", log.time(i), log.time(i - 1),
                                 log.runs.empty() ? " within a run" : fmt::format(" within run \"{}\"", log.runs[i])),
                     i);
    }
    steps.push_back(step);
  }
  if (steps.empty()) throw LogError("no run has two rows", -1);
  std::vector<double> sorted = steps;
  std::ranges::nth_element(sorted, sorted.begin() + std::ssize(sorted) / 2);
  const double median = sorted[sorted.size() / 2];
  const auto is_odd = [&](double step) { return std::abs(step - median) > unequal * median; };
  Timing timing;
  // Times that were rounded have two steps, and their mean is the right one.
  double sum = 0.0;
  std::size_t ordinary = 0;
  for (const double step : steps) {
    if (is_odd(step)) continue;
    sum += step;
    ++ordinary;
  }
  timing.step = sum / static_cast<double>(ordinary);

  std::size_t odd = 0;
  Eigen::Index first_odd = -1;
  std::size_t k = 0;
  Part part{0, 0};
  for (Eigen::Index i = 1; i < n; ++i) {
    const bool same = same_run(log, i - 1, i);
    const double step = same ? steps[k++] : 0.0;
    if (same && is_odd(step) && odd++ == 0) first_odd = i;
    if (!same || step > gap * median) {
      timing.parts.push_back(part);
      part.first = i;
    }
    part.last = i;
  }
  timing.parts.push_back(part);
  if (static_cast<double>(odd) > most_unequal * static_cast<double>(steps.size())) {
    throw LogError(fmt::format("{} of {} steps of time differ from their median, {:.6g} s, by more than half of it, "
                               "here for the first time; the log must be sampled at an even rate",
                               odd, steps.size(), median),
                   first_odd);
  }
  return timing;
}

SampledStretch samples_of(const Log& log, const Part& part, double step) {
  const Eigen::Index n = part.last - part.first + 1;
  Eigen::MatrixXd values(log.time.size(), log.positions.cols() + log.torques.cols());
  values.leftCols(log.positions.cols()) = log.positions;
  if (log.torques.cols() > 0) values.rightCols(log.torques.cols()) = log.torques;
  const auto time = log.time.segment(part.first, n);
  SampledStretch samples;
  samples.start = time(0);
  samples.step = n > 1 ? (time(n - 1) - time(0)) / static_cast<double>(n - 1) : step;
  const Eigen::VectorXd even = Eigen::VectorXd::LinSpaced(n, time(0), time(n - 1));
  const double deviation = (time - even).cwiseAbs().maxCoeff();
  if (deviation <= equal * step || deviation <= resolution_of(time) || n < 4) {
    samples.values = values.middleRows(part.first, n);
    for (Eigen::Index i = 0; i < n; ++i) samples.rows.push_back(part.first + i);
    return samples;
  }
  samples.interpolated = true;
  const auto count = static_cast<Eigen::Index>(std::floor((time(n - 1) - time(0)) / step * (1.0 + 1e-12))) + 1;
  samples.step = step;
  samples.values.resize(count, values.cols());
  Eigen::Index left = part.first;
  for (Eigen::Index i = 0; i < count; ++i) {
    const double t = samples.start + static_cast<double>(i) * step;
    while (left < part.last && log.time(left + 1) <= t) ++left;
    samples.values.row(i) = interpolated(log.time, values, left, part, t);
    const bool right_is_nearer = left < part.last && log.time(left + 1) - t < t - log.time(left);
    samples.rows.push_back(right_is_nearer ? left + 1 : left);
  }
  return samples;
}

}  // namespace llmt::discovery
