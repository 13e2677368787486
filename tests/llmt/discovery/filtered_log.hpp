// From a raw log of one joint to rows by signals(), a simulation at them, and find_missing().
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "llmt/discovery/signals.hpp"
#include "llmt/discovery/simulation.hpp"
#include "llmt/discovery/terms.hpp"
#include "llmt/random.hpp"

namespace log_test {

using namespace llmt::discovery;

inline constexpr double inertia = 0.4;
inline constexpr double viscous = 1.1;
inline constexpr double gravity = 9.0;
inline constexpr double rate = 250.0;
inline constexpr Eigen::Index samples = 8000;

// Position, speed, acceleration of a joint that reverses about once a second.
inline Eigen::Vector3d motion(double t) {
  Eigen::Vector3d state = Eigen::Vector3d::Zero();
  double phase = 0.3;
  for (const double w : {1.1, 2.3, 3.7}) {
    const double size = 0.9 / w;
    state +=
        size * Eigen::Vector3d(std::sin(w * t + phase), w * std::cos(w * t + phase), -w * w * std::sin(w * t + phase));
    phase += 1.9;
  }
  return state;
}

struct Model {
  double dry = 0.0;

  double torque(const Eigen::Vector3d& x) const {
    const double sign = x(1) > 0.0 ? 1.0 : x(1) < 0.0 ? -1.0 : 0.0;
    return inertia * x(2) + viscous * x(1) + gravity * std::cos(x(0)) + dry * sign;
  }
};

struct LogRows {
  Inputs inputs;
  Eigen::MatrixXd simulated;
  MeasuredOutputs measured;
};

// `torque(t)` is what is measured, with white noise, as that of the encoder, in rad.
inline LogRows rows_of_log(std::uint64_t seed, const Model& model, double noise,
                           const std::function<double(double)>& torque, SignalsOptions options = {.cutoff = 6.0},
                           const std::function<Eigen::Vector3d(double)>& moved = motion, double encoder = 1e-5) {
  llmt::Random random(seed);
  Log log;
  log.time = Eigen::VectorXd::LinSpaced(samples, 0.0, static_cast<double>(samples - 1)) / rate;
  log.positions = log.time.unaryExpr([&](double t) { return moved(t)(0) + encoder * random.normal(); });
  log.torques = log.time.unaryExpr([&](double t) { return torque(t) + noise * random.normal(); });
  const Signals table = signals(log, options);
  LogRows rows;
  rows.inputs.names = {"q", "dq", "ddq"};
  rows.inputs.values.resize(table.time.size(), 3);
  rows.inputs.values << table.positions, table.velocities, table.accelerations;
  rows.inputs.instants = table.time;
  rows.inputs.cutoff = table.dense ? options.cutoff : 0.0;
  const ColumnNoise& position = table.position_noise[0];
  rows.inputs.noise = Eigen::Vector3d(position.in_table, position.of_velocity, position.of_acceleration);
  rows.measured = {{"u"}, table.torques, Eigen::VectorXd::Constant(1, table.torque_noise[0].in_table)};
  rows.simulated.resize(table.time.size(), 1);
  for (Eigen::Index i = 0; i < rows.simulated.rows(); ++i) {
    rows.simulated(i, 0) = model.torque(rows.inputs.values.row(i).transpose());
  }
  return rows;
}

inline Missing missing_from(const LogRows& rows) {
  std::vector<ModelTerm> terms = standard_terms(rows.inputs);
  for (ModelTerm& term : regime_terms(rows.inputs, terms)) terms.push_back(std::move(term));
  for (ModelTerm& term : inner_state_terms(rows.inputs, rows.simulated, {"u"})) terms.push_back(std::move(term));
  return find_missing(tabulated(rows.simulated, {"u"}), rows.inputs, rows.measured, terms);
}

}  // namespace log_test
