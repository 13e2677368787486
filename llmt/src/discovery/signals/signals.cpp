#include "llmt/discovery/signals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "discovery/signals/kernel.hpp"
#include "discovery/signals/noise.hpp"
#include "discovery/signals/stretches.hpp"

namespace llmt::discovery {
namespace {

// A sample of the noise in the filtered velocity exceeds this many standard deviations once in 16 000.
constexpr double known_sign = 4.0;

struct Filtered {
  Eigen::Index stretch = 0;
  double time = 0.0;
  Eigen::Index row = 0;
  Eigen::MatrixXd values;  // columns of samples x (value, first, second derivative)
};

void check_options(const SignalsOptions& options, Eigen::Index positions, double step) {
  if (!(options.cutoff > 0.0) || !std::isfinite(options.cutoff)) {
    throw LogError(fmt::format("the cutoff is {} Hz, must be above 0", options.cutoff), -1);
  }
  const double highest = 0.25 / step;
  if (options.cutoff > highest * (1.0 + 1e-9)) {
    throw LogError(fmt::format("the cutoff is {:.6g} Hz, must be at most a quarter of the sampling rate: {:.6g} Hz of "
                               "{:.6g} Hz",
                               options.cutoff, highest, 1.0 / step),
                   -1);
  }
  if (options.every < 0) throw LogError(fmt::format("every is {}, must be 0 or more", options.every), -1);
  const std::size_t given = options.standstill.size();
  if (given > 1 && static_cast<Eigen::Index>(given) != positions) {
    throw LogError(fmt::format("{} speeds of standstill for {} positions", given, positions), -1);
  }
  for (const double speed : options.standstill) {
    if (!(speed >= 0.0) || !std::isfinite(speed)) {
      throw LogError(fmt::format("the speed of standstill is {}, must be 0 or more", speed), -1);
    }
  }
}

ColumnNoise noise_of(double deviation, const Kernel& kernel, double relative_rounding, bool differentiated) {
  ColumnNoise noise;
  noise.in_log = deviation > relative_rounding ? deviation : 0.0;  // below it are the digits of double
  const Eigen::RowVector3d gains = kernel.weights.colwise().norm();
  noise.in_table = noise.in_log * gains(0);
  if (!differentiated) return noise;
  noise.of_velocity = noise.in_log * gains(1);
  noise.of_acceleration = noise.in_log * gains(2);
  return noise;
}

double largest_speed(const std::vector<Filtered>& rows, Eigen::Index position) {
  double largest = 0.0;
  for (const Filtered& row : rows) largest = std::max(largest, std::abs(row.values(position, 1)));
  return largest;
}

// Speeds found from the noise: a position that is never several times as fast is taken for one that never moves,
// because nearly all rows would be left out for it.
void set_standstill(Signals& signals, const SignalsOptions& options, const Log& log, const std::vector<Filtered>& rows,
                    const Kernel& kernel) {
  constexpr double several = 5.0;
  constexpr double rounding = 1e-14;
  const std::vector<double>& given = options.standstill;
  signals.lobe = given.empty() ? kernel.lobe : 0.0;
  for (std::size_t j = 0; j < signals.position_noise.size(); ++j) {
    const auto position = static_cast<Eigen::Index>(j);
    const double largest = largest_speed(rows, position);
    // Of a constant signal.
    const double smallest =
        rounding * kernel.weights.col(1).lpNorm<1>() * log.positions.col(position).cwiseAbs().maxCoeff();
    const double found = std::max(smallest, known_sign * signals.position_noise[j].of_velocity);
    const double speed = given.empty() ? found : given[given.size() == 1 ? 0 : j];
    signals.standstill.push_back(speed);
    signals.moves.push_back(largest > std::max(smallest, given.empty() ? several * speed : speed));
  }
}

// Whether any position stands still or reverses.
bool stands(const Signals& signals, const Filtered& row) {
  for (std::size_t j = 0; j < signals.standstill.size(); ++j) {
    if (!signals.moves[j]) continue;
    const double speed = std::abs(row.values(static_cast<Eigen::Index>(j), 1));
    const double reversal = signals.lobe * std::abs(row.values(static_cast<Eigen::Index>(j), 2));
    if (speed < std::max(signals.standstill[j], reversal)) return true;
  }
  return false;
}

void fill(Signals& signals, const std::vector<Filtered>& rows, Eigen::Index positions) {
  const Eigen::Index m = std::ssize(rows);
  const Eigen::Index torques = rows.front().values.rows() - positions;
  signals.time.resize(m);
  signals.torques.resize(m, torques);
  for (Eigen::MatrixXd* columns : {&signals.positions, &signals.velocities, &signals.accelerations}) {
    columns->resize(m, positions);
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    const Filtered& row = rows[i];
    signals.time(i) = row.time;
    signals.rows.push_back(row.row);
    ++signals.stretches[row.stretch].kept;
    signals.positions.row(i) = row.values.col(0).head(positions).transpose();
    signals.velocities.row(i) = row.values.col(1).head(positions).transpose();
    signals.accelerations.row(i) = row.values.col(2).head(positions).transpose();
    if (torques > 0) signals.torques.row(i) = row.values.col(0).tail(torques).transpose();
  }
}

}  // namespace

Signals signals(const Log& log, const SignalsOptions& options) {
  check_log(log);
  const Timing timing = timing_of(log);
  const Eigen::Index positions = log.positions.cols();
  const Eigen::Index columns = positions + log.torques.cols();
  check_options(options, positions, timing.step);

  Signals signals;
  signals.step = timing.step;
  constexpr Eigen::Index denser = 12;
  const Eigen::Index independent = independent_step(options.cutoff, timing.step);
  const bool drops = options.independent || !options.standstill.empty();
  signals.every = options.every > 0 ? options.every
                  : drops           ? independent
                                    : std::max<Eigen::Index>(1, independent / denser);
  signals.dense = !drops && 2 * signals.every <= independent;
  const Eigen::Index half = half_length(options.cutoff, timing.step);
  signals.half_length = static_cast<double>(half) * timing.step;
  const auto longest = std::ranges::max(timing.parts, {}, [](const Part& part) { return part.last - part.first; });
  if (longest.last - longest.first < 2 * half) {
    throw LogError(fmt::format("the longest run without a gap takes {:.4g} s, the filter cuts {:.4g} s at either end; "
                               "a longer run or a higher cutoff is needed",
                               static_cast<double>(longest.last - longest.first) * timing.step, signals.half_length),
                   longest.first);
  }
  const Kernel kernel = kernel_of(options.cutoff, timing.step);
  signals.correlation = correlation_at(kernel, signals.every);

  std::vector<std::vector<Eigen::VectorXd>> stretches(columns);
  std::vector<Filtered> rows;
  for (const Part& part : timing.parts) {
    signals.stretches.push_back({log.runs.empty() ? "" : log.runs[part.first], part.first, part.last, 0});
    const SampledStretch samples = samples_of(log, part, timing.step);
    const Eigen::Index n = samples.values.rows();
    signals.resampled = signals.resampled || samples.interpolated;
    signals.ends_cut += std::min(n, 2 * half);
    for (Eigen::Index c = 0; c < columns; ++c) stretches[c].emplace_back(samples.values.col(c));
    for (Eigen::Index i = half; i + half < n; i += signals.every) {
      rows.push_back({std::ssize(signals.stretches) - 1, samples.start + static_cast<double>(i) * samples.step,
                      samples.rows[i], samples.values.middleRows(i - half, 2 * half + 1).transpose() * kernel.weights});
    }
  }
  for (Eigen::Index c = 0; c < columns; ++c) {
    const double largest =
        (c < positions ? log.positions.col(c) : log.torques.col(c - positions)).cwiseAbs().maxCoeff();
    std::vector<ColumnNoise>& noise = c < positions ? signals.position_noise : signals.torque_noise;
    const double deviation = noise_at_cutoff(stretches[c], options.cutoff, timing.step);
    noise.push_back(noise_of(deviation, kernel, 1e-15 * largest, c < positions));
  }
  set_standstill(signals, options, log, rows, kernel);
  if (drops) {
    signals.standing =
        static_cast<Eigen::Index>(std::erase_if(rows, [&](const Filtered& row) { return stands(signals, row); }));
  }
  if (rows.empty()) throw LogError("no row is left: a position stands still or reverses in all of them", -1);
  fill(signals, rows, positions);
  return signals;
}

}  // namespace llmt::discovery
