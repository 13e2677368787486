// Terms of states that follow the inputs slowly, or swing behind them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "discovery/recording/derivatives.hpp"
#include "discovery/recording/noise.hpp"
#include "discovery/terms/term_builders.hpp"
#include "discovery/terms/term_model.hpp"

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

std::vector<TermConstant> constants_of_ringing(std::vector<double> frequencies) {
  return {{.name = "frequency", .unit = "per unit of time", .tried = std::move(frequencies)},
          {.name = "damping ratio", .unit = "1", .tried = {0.02, 0.04, 0.08, 0.16}}};
}

Eigen::VectorXd ringing(const Rows& rows, const Eigen::VectorXd& signal, const Eigen::VectorXd& constants) {
  constexpr double least = 1e-3;
  constexpr double most = 0.2;
  return -resonant_part(rows, signal, std::max(constants(0), smallest_divisor), std::clamp(constants(1), least, most));
}

namespace {

constexpr int simple = 12;  // after the terms of the row itself, see ModelTerm::complexity

// From `low` to `high` in equal ratios of at most `ratio`.
std::vector<double> in_ratios(double low, double high, double ratio) {
  const int steps = std::max(1, static_cast<int>(std::ceil(std::log(high / low) / std::log(ratio))));
  std::vector<double> values;
  for (int k = 0; k <= steps; ++k) values.push_back(low * std::pow(high / low, static_cast<double>(k) / steps));
  return values;
}

double longest_run(const Rows& rows) {
  double longest = 0.0;
  double begin = 0.0;
  for (std::size_t k = 0; k < rows.sequence.size(); ++k) {
    const double now = rows.instants(rows.sequence[k]);
    if (k == 0 || now < rows.instants(rows.sequence[k - 1])) begin = now;
    longest = std::max(longest, now - begin);
  }
  return longest;
}

// Change by time, from the rows on both sides.
Eigen::VectorXd slope(const Rows& rows, const Eigen::VectorXd& signal) {
  Eigen::VectorXd slopes = Eigen::VectorXd::Zero(signal.size());
  const std::vector<Recorded> recorded = recordings(rows);
  for (Eigen::Index k = 0; k < std::ssize(rows.sequence); ++k) {
    const Eigen::Index before = rows.sequence[std::max(recorded[k].begin, k - 1)];
    const Eigen::Index after = rows.sequence[std::min(recorded[k].end - 1, k + 1)];
    if (before == after) continue;
    slopes(rows.sequence[k]) = (signal(after) - signal(before)) / (rows.instants(after) - rows.instants(before));
  }
  return slopes;
}

ModelTerm lag_of_output(const std::string& output, const std::vector<double>& times) {
  ModelTerm term;
  term.family = "lag";
  term.formula = "s behind a first-order lag, minus s: tau dz/dt = s - z; for a negative tau s - tau ds/dt, minus s";
  term.coefficients = {"share"};
  term.whole = true;
  term.columns = [](const Rows& rows, const Eigen::VectorXd& constants) -> Eigen::MatrixXd {
    const double tau = constants(0);
    if (tau > 0.0) return lagged(rows, rows.simulated, tau, true) - rows.simulated;
    return -tau * slope(rows, rows.simulated);
  };
  std::vector<double> tried;
  for (auto time = times.rbegin(); time != times.rend(); ++time) tried.push_back(-*time);
  tried.insert(tried.end(), times.begin(), times.end());
  term.constants = {{.name = "time constant", .unit = "units of time", .tried = tried}};
  term.output = output;
  term.inner_state = "a first-order lag, or a lead";
  term.shown_by = "a signal measured behind the actuator or before the sensor";
  term.complexity = simple;
  return term;
}

// One coefficient, and a time constant.
ModelTerm slow_state(std::string family, const std::string& input, std::string formula, std::string per,
                     const std::vector<double>& times,
                     std::function<Eigen::VectorXd(const Rows&, const Eigen::VectorXd&, double)> column,
                     Eigen::Index place, const std::string& output) {
  ModelTerm term;
  term.family = std::move(family);
  term.location = input;
  term.formula = std::move(formula);
  term.inputs = {input};
  term.coefficients = {"coefficient"};
  term.per = std::move(per);
  term.columns = [column = std::move(column), place](const Rows& rows, const Eigen::VectorXd& constants) {
    return Eigen::MatrixXd(column(rows, rows.inputs.col(place), std::max(smallest_divisor, constants(0))));
  };
  term.constants = {{.name = "time constant", .unit = "units of time", .tried = times}};
  term.output = output;
  term.inner_state = fmt::format("something that remembers {} for about its time constant", input);
  term.shown_by = "a sensor of the temperature, level or position that follows slowly";
  term.complexity = simple;
  return term;
}

ModelTerm swing(const std::string& input, std::vector<double> frequencies, Eigen::Index place,
                const std::string& output) {
  ModelTerm term;
  term.family = "resonance";
  term.location = input;
  term.formula = fmt::format(
      "(H - 1) {}, H = (2 z w p + w^2)/(p^2 + 2 z w p + w^2), w = 2 pi frequency, z = damping ratio, p = d/dt", input);
  term.inputs = {input};
  term.coefficients = {"coefficient"};
  term.per = input;
  term.columns = [place](const Rows& rows, const Eigen::VectorXd& constants) -> Eigen::MatrixXd {
    return ringing(rows, rows.inputs.col(place), constants);
  };
  term.constants = constants_of_ringing(std::move(frequencies));
  term.output = output;
  term.inner_state = "a resonance, as of a load that swings";
  term.shown_by = "an encoder or an accelerometer at the load";
  term.complexity = simple;
  return term;
}

}  // namespace

Eigen::VectorXd lagged(const Rows& rows, const Eigen::VectorXd& signal, double tau, bool starts_settled) {
  Eigen::VectorXd z(signal.size());
  double state = 0.0;
  for (std::size_t k = 0; k < rows.sequence.size(); ++k) {
    const Eigen::Index row = rows.sequence[k];
    const double now = signal(row);
    const double duration = k > 0 ? rows.instants(row) - rows.instants(rows.sequence[k - 1]) : 0.0;
    if (k == 0 || duration < 0.0) {
      state = starts_settled ? now : 0.0;
    } else if (duration > 0.0) {
      // z follows a straight line x = a + b t by a + b (t - tau), and forgets what it is off.
      const double before = signal(rows.sequence[k - 1]);
      const double behind = (now - before) / duration * tau;
      state = now - behind + (state - before + behind) * std::exp(-duration / tau);
    }
    z(row) = state;
  }
  return z;
}

std::vector<ModelTerm> memory_terms(const Recording& recording, const std::string& output) {
  const Inputs& inputs = recording.inputs();
  const Rows& rows = recording.rows();
  constexpr double ratio = 1.5;
  const double step = median_step(rows);
  const double fast = step * static_cast<double>(recording.lag());  // a tenth of a period
  const double whole = longest_run(rows);
  std::vector<ModelTerm> terms;
  if (!(step > 0.0) || !(whole > 10.0 * fast)) return terms;
  terms.push_back(lag_of_output(output, in_ratios(0.002 * fast, 10.0 * fast, 2.0)));
  const std::vector<double> times = in_ratios(2.0 * fast, whole, ratio);
  for (Eigen::Index j = 0; j < inputs.values.cols(); ++j) {
    const std::string& x = inputs.names[static_cast<std::size_t>(j)];
    if (!(inputs.values.col(j).maxCoeff() > inputs.values.col(j).minCoeff())) continue;
    using Column = Eigen::VectorXd;
    terms.push_back(slow_state(
        "memory", x, fmt::format("{0} - lag {0}, tau d(lag)/dt = {0} - lag", x), x, times,
        [](const Rows& own, const Column& v, double tau) -> Column { return v - lagged(own, v, tau, true); }, j,
        output));
    terms.push_back(slow_state(
        "warming", x, fmt::format("{0} lag {0}^2, tau d(lag)/dt = {0}^2 - lag", x), x + "^3", times,
        [](const Rows& own, const Column& v, double tau) -> Column {
          return v.cwiseProduct(lagged(own, v.cwiseAbs2(), tau, false));
        },
        j, output));
    terms.push_back(slow_state(
        "warmth", x, fmt::format("lag {0}^2, tau d(lag)/dt = {0}^2 - lag", x), x + "^2", times,
        [](const Rows& own, const Column& v, double tau) -> Column { return lagged(own, v.cwiseAbs2(), tau, false); },
        j, output));
  }
  std::vector<Eigen::Index> moving;
  for (const Motion& motion : recording.axes()) {
    moving.push_back(motion.speed);
    moving.push_back(motion.acceleration);
  }
  std::ranges::sort(moving);
  moving.erase(std::ranges::unique(moving).begin(), moving.end());
  // From a tenth of the frequency of the motion to twice as much: at a higher one H takes the noise of x off, and no
  // motion.
  const std::vector<double> frequencies = in_ratios(0.01 / fast, 0.2 / fast, 1.1);
  for (const Eigen::Index j : moving) {
    terms.push_back(swing(inputs.names[static_cast<std::size_t>(j)], frequencies, j, output));
  }
  return terms;
}

}  // namespace llmt::discovery
