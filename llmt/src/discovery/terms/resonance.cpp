#include "discovery/terms/resonance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "discovery/recording/derivatives.hpp"
#include "discovery/recording/noise.hpp"

namespace llmt::discovery {
namespace {

// z'' + 2 zeta w z' + w^2 z = u, from one row to the next.
class Oscillator {
 public:
  Oscillator(double frequency, double damping) : omega_(2.0 * std::numbers::pi * frequency), damping_(damping) {}

  void rest(double u) {
    z_ = u / (omega_ * omega_);
    speed_ = 0.0;
  }

  // u goes from `before` to `now` in a straight line.
  void step(double before, double now, double duration) {
    if (std::abs(duration - duration_) > same_time * duration) prepare(duration);
    const double slope = (now - before) / duration;
    const double square = omega_ * omega_;
    const double lag = 2.0 * damping_ * slope / (square * omega_);
    const double z = z_ - before / square + lag;
    const double speed = speed_ - slope / square;
    z_ = z_by_z_ * z + z_by_speed_ * speed + now / square - lag;
    speed_ = speed_by_z_ * z + speed_by_speed_ * speed + slope / square;
  }

  // z''
  double acceleration(double u) const { return u - 2.0 * damping_ * omega_ * speed_ - omega_ * omega_ * z_; }

 private:
  double omega_;
  double damping_;
  double duration_ = 0.0;
  double z_ = 0.0;
  double speed_ = 0.0;
  double z_by_z_ = 1.0;
  double z_by_speed_ = 0.0;
  double speed_by_z_ = 0.0;
  double speed_by_speed_ = 1.0;

  void prepare(double duration) {
    const double damped = omega_ * std::sqrt(1.0 - damping_ * damping_);
    const double decay = std::exp(-damping_ * omega_ * duration);
    const double cosine = decay * std::cos(damped * duration);
    const double sine = decay * std::sin(damped * duration) / damped;
    z_by_z_ = cosine + damping_ * omega_ * sine;
    z_by_speed_ = sine;
    speed_by_z_ = -omega_ * omega_ * sine;
    speed_by_speed_ = cosine - damping_ * omega_ * sine;
    duration_ = duration;
  }
};

}  // namespace

Eigen::VectorXd resonant_part(const Rows& rows, const Eigen::VectorXd& signal, double frequency, double damping) {
  const double longest = std::max(1.0 / frequency, interruption * median_step(rows));
  Oscillator oscillator(frequency, damping);
  Eigen::VectorXd part(signal.size());
  for (std::size_t k = 0; k < rows.sequence.size(); ++k) {
    const Eigen::Index row = rows.sequence[k];
    const double now = signal(row);
    const Eigen::Index before = k > 0 ? rows.sequence[k - 1] : row;
    const double duration = rows.instants(row) - rows.instants(before);
    if (duration > 0.0 && duration <= longest) {
      oscillator.step(signal(before), now, duration);
    } else {
      oscillator.rest(now);
    }
    part(row) = oscillator.acceleration(now);
  }
  return part;
}

std::vector<double> resonant_frequencies(const Rows& rows) {
  constexpr double lag_of_a_period = 0.1;  // see smooth_lag()
  constexpr double steps_of_a_period = 3.0;
  constexpr double ratio = 1.08;
  constexpr int most = 40;
  const double step = median_step(rows);
  if (!(step > 0.0)) return {};
  const double lowest = lag_of_a_period / (step * static_cast<double>(smooth_lag(rows, rows.simulated)));
  const double highest = 1.0 / (steps_of_a_period * step);
  const int count = std::min(most, static_cast<int>(std::log(highest / lowest) / std::log(ratio)) + 1);
  std::vector<double> values;
  for (int k = 0; k < count; ++k) {
    values.push_back(lowest * std::pow(highest / lowest, k / std::max(1.0, static_cast<double>(count - 1))));
  }
  return values;
}

}  // namespace llmt::discovery
