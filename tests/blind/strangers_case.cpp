#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "blind/arms.hpp"
#include "blind/strangers.hpp"

namespace blind {
namespace {

constexpr double visible = 150.0;  // energy beyond geometry, in noise units
constexpr double widest_ratio = 30.0;

double rms_length(const Eigen::MatrixXd& points) { return std::sqrt(points.rowwise().squaredNorm().mean()); }

bool contains_kind(const std::vector<std::string>& kinds, const std::string& kind) {
  return std::ranges::find(kinds, kind) != kinds.end();
}

// Effects that are one thing under two names on some arms, or in part, do not make a fair pair.
bool fair(const std::vector<std::string>& kinds) {
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (std::ranges::count(kinds, kinds[i]) > 1) return false;
  }
  const auto together = [&](const std::vector<std::string>& group) {
    return std::ranges::count_if(group, [&](const std::string& kind) { return contains_kind(kinds, kind); }) > 1;
  };
  return !together({"joint_compliance", "link_bending", "elastic_base", "link_torsion"}) &&
         !together({"backlash_gravity", "backlash_approach", "hysteresis"}) && !together({"drift", "tracker_knock"}) &&
         !together({"eccentricity", "eccentricity_twice", "joint_gain"});
}

std::vector<std::string> draw_kinds(const StrangerOrder& order, const Arm& arm, llmt::Random& random) {
  const auto any = [&](const std::vector<std::string>& kinds) { return kinds[random.below(kinds.size())]; };
  if (order.set == "none" || order.set == "gross_none") return {};
  if (order.set == "soft_backlash") return {"backlash_soft"};
  if (order.set == "unknown") return {any({"cross", "step", "saw"})};
  if (order.set == "instrument") return {any({"instrument_azimuth", "instrument_azimuth", "instrument_range"})};
  const std::vector<std::string> listed = stranger_kinds(arm);
  if (order.set != "several") return {any(listed)};
  std::vector<std::string> kinds;
  do {
    kinds = {any(listed), any(listed)};
    if (random.uniform() < 0.25) kinds.push_back(any(listed));
  } while (!fair(kinds));
  return kinds;
}

// Energy of each effect that the others cannot imitate.
std::vector<double> beyond_others(const std::vector<Eigen::VectorXd>& seen) {
  std::vector<double> energy;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    Eigen::VectorXd own = seen[k];
    if (seen.size() > 1) {
      Eigen::MatrixXd others(own.size(), seen.size() - 1);
      for (std::size_t i = 0, c = 0; i < seen.size(); ++i) {
        if (i != k) others.col(static_cast<Eigen::Index>(c++)) = seen[i];
      }
      own -= others * Eigen::MatrixXd(others).colPivHouseholderQr().solve(own);
    }
    energy.push_back(own.squaredNorm());
  }
  return energy;
}

bool hide(Case& c, const StrangerOrder& order, llmt::Random& random) {
  const Pieces pieces(c.arm);
  const StrangerScale scale = stranger_scale(order.arm);
  const Session& session = c.sessions.measured;
  const GeometryFree free(c.arm, {}, session);
  const Eigen::MatrixXd without = positions_mm(c.arm, {}, {}, session);
  const std::vector<std::string> kinds = draw_kinds(order, c.described, random);
  constexpr int attempts = 8;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    c.hidden.clear();
    std::vector<Eigen::VectorXd> seen;
    for (const std::string& kind : kinds) {
      c.hidden.push_back({draw_stranger(kind, {c.arm, pieces, scale, session, random}), 0.0, 0.0, 0.0});
      const Eigen::MatrixXd moved = positions_mm(c.arm, {}, {&c.hidden.back().effect}, session) - without;
      c.hidden.back().rms_mm = rms_length(moved);
      seen.push_back(free(moved) / c.noise_mm);
      c.hidden.back().lambda = seen.back().squaredNorm();
    }
    const std::vector<double> beyond = beyond_others(seen);
    for (std::size_t k = 0; k < beyond.size(); ++k) c.hidden[k].lambda_beyond_other = beyond[k];
    const auto [low, high] =
        std::minmax_element(c.hidden.begin(), c.hidden.end(),
                            [](const HiddenShare& a, const HiddenShare& b) { return a.lambda < b.lambda; });
    c.lambda = low->lambda;
    const bool enough = *std::ranges::min_element(beyond) >= visible;
    const bool comparable = high->lambda <= widest_ratio * widest_ratio * low->lambda;
    if (enough && comparable) return true;
    // Some single effects too small to be seen stay among the cases.
    if (kinds.size() == 1 && order.set == "single" && (attempt + 1 == attempts || random.uniform() < 0.1)) return true;
  }
  return false;
}

// One to six coordinates, or rows whose positions changed places.
void spoil(Case& c, llmt::Random& random) {
  Eigen::MatrixXd& points = c.measured_mm;
  const auto rows = random.permutation(points.rows());
  if (random.uniform() < 0.25) {
    points.row(rows[0]).swap(points.row(rows[1]));
    c.outliers = {static_cast<int>(rows[0]), static_cast<int>(rows[1])};
  } else {
    const auto count = 1 + random.below(6);
    for (std::uint64_t k = 0; k < count; ++k) {
      const auto row = rows[k];
      const auto axis = static_cast<Eigen::Index>(random.below(c.arm.planar ? 2 : 3));
      points(row, axis) += sign(random) * log_uniform(random, 5.0, 500.0);
      c.outliers.push_back(static_cast<int>(row));
    }
  }
  std::ranges::sort(c.outliers);
}

void measure_strangers(Case& c, llmt::Random& random) {
  std::vector<const Hidden*> all;
  for (const HiddenShare& share : c.hidden) all.push_back(&share.effect);
  c.measured_mm = positions_mm(c.arm, {}, all, c.sessions.measured);
  c.held_out_mm = positions_mm(c.arm, {}, all, c.sessions.held_out);
  c.fresh_mm = positions_mm(c.arm, {}, all, c.sessions.fresh);
  for (Eigen::MatrixXd* points : {&c.measured_mm, &c.held_out_mm}) {
    for (double& value : points->reshaped()) value += c.noise_mm * random.normal();
  }
}

}  // namespace

Case make_stranger(const StrangerOrder& order) {
  llmt::Random random(order.seed);
  constexpr std::array<double, 5> ratios = {50, 80, 100, 120, 160};
  constexpr std::array<int, 4> poses = {45, 70, 110, 180};
  constexpr std::array<double, 4> noise = {8e-3, 15e-3, 30e-3, 60e-3};
  for (int attempt = 0; attempt < 200; ++attempt) {
    Case c;
    c.order = {order.arm, order.set, order.set.starts_with("gross") ? "outliers" : "", order.seed};
    c.described = stranger_arm(order.arm);
    for (Joint& joint : c.described.joints) joint.gear_ratio = ratios[random.below(ratios.size())];
    c.arm = build_stranger(c.described, random);
    c.options.poses = poses[random.below(poses.size())];
    c.noise_mm = noise[random.below(noise.size())];
    c.options.two_payloads = random.uniform() < 0.6;
    c.options.repeats = random.uniform() < 0.25;
    c.sessions = make_sessions(c.described, stranger_scale(order.arm).payloads, c.options, random);
    if (order.set != "none" && order.set != "gross_none" && !hide(c, order, random)) continue;
    measure_strangers(c, random);
    if (order.set.starts_with("gross")) spoil(c, random);
    return c;
  }
  throw std::runtime_error(fmt::format("{}-{}-{}: nothing that could be seen", order.arm, order.set, order.seed));
}

std::vector<StrangerOrder> stranger_plan(int cases, std::uint64_t seed) {
  // Of twenty cases in turn.
  constexpr std::array<const char*, 20> sets = {
      "none", "single",  "several", "single",     "gross_single",  "none", "single", "several",    "unknown", "single",
      "none", "several", "single",  "instrument", "soft_backlash", "none", "single", "gross_none", "several", "single"};
  const std::vector<std::string> arms = stranger_arm_names();
  std::vector<StrangerOrder> orders;
  for (int i = 0; i < cases; ++i) {
    // Every set meets every arm.
    const std::size_t set = i % sets.size(), arm = (i + i / sets.size()) % arms.size();
    orders.push_back({arms[arm], sets[set], seed * 1000000 + static_cast<std::uint64_t>(i)});
    // An instrument that is off in height and range sees nothing of a planar arm's z.
    if (orders.back().set == "instrument" && orders.back().arm == "scara2") orders.back().arm = "cobot6";
  }
  return orders;
}

}  // namespace blind
