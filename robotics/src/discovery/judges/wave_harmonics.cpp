#include "discovery/judges/wave_harmonics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "discovery/investigation/pose_split.hpp"
#include "linear_algebra/linear_algebra.hpp"

namespace llmt::robotics {
namespace {

// The final fit and its residuals.
struct Rest {
  const Robot& robot;
  Measurements kept;
  std::vector<Eigen::Index> rows;  // coordinates that were measured
  Eigen::VectorXd errors;
  RangeRotation to_range;  // of the derivatives by all free parameters
  Eigen::Index rank = 0;
};

Rest rest_of(const Investigation& investigation) {
  const Calibration& fitted = investigation.fitted;
  Rest rest{.robot = fitted.robot, .kept = investigation.kept(), .rows = {}, .errors = {}, .to_range = {}, .rank = 0};
  rest.rows = measured_rows(rest.kept);
  rest.errors = stacked(rest.kept.positions_mm - positions(fitted.robot, rest.kept.poses), rest.rows);
  std::vector<Eigen::Index> free;
  for (std::size_t k = 0; k < fitted.robot.identified.size(); ++k) {
    if (fitted.robot.identified[k].state == "free") free.push_back(static_cast<Eigen::Index>(k));
  }
  Eigen::MatrixXd columns = rows_of(position_jacobian(fitted.robot, rest.kept.poses, free), rest.rows);
  normalize_columns(columns);
  rest.rank = columns.cols();
  rest.to_range = RangeRotation(columns);
  return rest;
}

// The components orthogonal to the range of the fit.
Eigen::MatrixXd beyond_fit(const Rest& rest, const Eigen::MatrixXd& columns) {
  const Eigen::MatrixXd turned = rest.to_range(columns);
  return turned.bottomRows(turned.rows() - rest.rank);
}

constexpr double by_chance = 4.2;  // F(6, 100 and more) exceeds this once in a thousand
constexpr double material = 0.06;  // of the wave's own energy; of a saw tooth 0.21

struct Harmonics {
  double energy = 0.0;          // mm^2
  double variance_ratio = 0.0;  // to the residuals beside them
};

Harmonics harmonics_of(const Rest& rest, const Effect& wave) {
  std::vector<Effect> tones;
  for (const double times : {3.0, 4.0, 5.0}) {
    tones.push_back(wave);
    tones.back().constants[0] *= times;
  }
  const Eigen::MatrixXd columns =
      beyond_fit(rest, rows_of(effect_signatures(rest.robot, tones, rest.kept.poses), rest.rows));
  const Eigen::VectorXd errors = beyond_fit(rest, rest.errors);
  const Eigen::Index count = columns.cols();
  const Eigen::Index left = errors.size() - count;
  if (left < 2 * count) return {};
  const Eigen::VectorXd turned = RangeRotation(columns)(errors);
  const double energy = turned.head(count).squaredNorm();
  const double variance = turned.tail(left).squaredNorm() / static_cast<double>(left);
  return {energy, energy / static_cast<double>(count) / std::max(variance, 1e-300)};
}

// mm^2
double energy_of(const FoundEffect& wave, const Rest& rest) {
  return wave.rms_mm * wave.rms_mm * static_cast<double>(rest.kept.count());
}

// 2, 3, ... if the other wave is a harmonic of the same joint, else 0.
int multiple_of(const FoundEffect& wave, const FoundEffect& other) {
  constexpr double slack = 0.01;
  const double ratio = other.effect.constants[0] / wave.effect.constants[0];
  const double whole = std::round(ratio);
  const bool is_harmonic = wave.effect.at == other.effect.at && whole > 1.5 && std::abs(ratio - whole) < slack * whole;
  return is_harmonic ? static_cast<int>(whole) : 0;
}

}  // namespace

std::vector<std::size_t> waves_at(const std::vector<FoundPattern>& patterns, const std::vector<Name>& names) {
  std::vector<std::size_t> waves;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const Effect& effect = names[k].effect.effect;
    const auto acts_there = [&](const FoundPattern& one) { return one.pattern.acts_on == effect.at; };
    if (nature_of(effect) == Nature::wave && std::ranges::any_of(patterns, acts_there)) waves.push_back(k);
  }
  return waves;
}

std::optional<Objection> judge_waves(const Findings& found, const std::vector<bool>& stands) {
  std::vector<const FoundEffect*> waves;
  for (std::size_t k = 0; k < found.names.size(); ++k) {
    if (stands[k] && nature_of(found.names[k].effect.effect) == Nature::wave) waves.push_back(&found.names[k].effect);
  }
  if (waves.empty()) return std::nullopt;
  const Rest rest = rest_of(found.investigation);
  Objection objection{Reason::harmonics};
  for (const FoundEffect* wave : waves) {
    const Harmonics left = harmonics_of(rest, wave->effect);
    double energy = left.variance_ratio < by_chance ? 0.0 : left.energy;
    for (const FoundEffect* other : waves) {
      if (multiple_of(*wave, *other) > 2) energy += energy_of(*other, rest);
    }
    if (energy < material * energy_of(*wave, rest)) continue;
    const std::size_t joint = joint_index(rest.robot.chain, wave->effect.at);
    objection.unknown.push_back(
        {{wave->effect.at, {fmt::format("q{}", joint + 1)}, wave->effect.constants[0], "periodic, but no sine"},
         wave->share});
  }
  if (objection.unknown.empty()) return std::nullopt;
  // Other waves of that joint may be parts of it, too.
  objection.names = waves_at(objection.unknown, found.names);
  objection.notes.emplace_back(
      "A wave with overtones of three to five times its order is no sine: a saw tooth, or a step in every turn of a "
      "shaft.");
  return objection;
}

}  // namespace llmt::robotics
