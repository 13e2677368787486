#include "blind/case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace blind {
namespace {

// Below this an effect of a pair cannot be told from the noise, or from the other effect.
constexpr double pair_lambda = 150.0, beyond_lambda = 40.0, pair_ratio = 0.2;

double rms(const Eigen::MatrixXd& points) { return std::sqrt(points.rowwise().squaredNorm().mean()); }

// The same place and formula under two names.
bool aliases(const Arm& arm, const Hidden& a, const Hidden& b) {
  const auto either = [&](const char* one, const char* other) {
    return (a.kind == one && b.kind == other) || (b.kind == one && a.kind == other);
  };
  if (family(a.kind) == family(b.kind)) return true;
  if (either("counterbalance_spring", "eccentricity")) return true;
  if (either("backlash_gravity", "backlash_approach")) return true;  // a gap is one or the other
  // The description already has two soft joints; more softness is not a new effect.
  if (needs_elastic_description(a.kind) && b.kind == "joint_compliance") return true;
  if (needs_elastic_description(b.kind) && a.kind == "joint_compliance") return true;
  return arm.planar && (either("elastic_base", "joint_compliance") || either("elastic_base", "link_bending") ||
                        either("joint_compliance", "link_bending"));
}

std::vector<std::string> draw_kinds(const Order& order, const Arm& arm, llmt::Random& random) {
  if (order.kind == "none") return {};
  if (order.kind != "pair") return {order.kind};
  const std::vector<std::string> all = catalogue_kinds(arm);
  return {all[random.below(all.size())], all[random.below(all.size())]};
}

// The description knows two soft joints, and the robot has them.
void make_elastic(Case& c, bool very, llmt::Random& random) {
  const ArmScale scale = scale_of(c.order.arm);
  const int first = c.arm.planar ? 0 : 1;
  // A wrong load or gravity shows on a soft arm only, and the planar arm is a stiff one.
  const double low = very ? 0.7 * scale.main_high : std::sqrt(scale.main_low * scale.main_high);
  const double high = very ? (c.arm.planar ? 4.0 : 1.5) * scale.main_high : scale.main_high;
  c.base.joint_compliance.assign(c.arm.size(), 0.0);
  for (const int joint : {first, first + 1}) {
    const double value = log_uniform(random, low, high);
    c.base.joint_compliance[joint] = value;
    c.elastic_joints.push_back(joint);
    c.elastic_values.push_back(value);
  }
}

// How much of the described deflection a tool misses that takes weight where the rigid arm would be.
void measure_softness(Case& c) {
  constexpr double little = 1e-3;
  Elasticity stiffer = c.base;
  for (double& compliance : stiffer.joint_compliance) compliance *= little;
  const Session& session = c.sessions.measured;
  const Eigen::MatrixXd rigid = positions_mm(c.arm, {}, {}, session);
  const Eigen::MatrixXd bent = positions_mm(c.arm, c.base, {}, session) - rigid;
  const Eigen::MatrixXd first_order = (positions_mm(c.arm, stiffer, {}, session) - rigid) / little;
  c.deflection_mm = rms(bent);
  c.lambda_beyond_first_order = (GeometryFree(c.arm, c.base, session)(bent - first_order) / c.noise_mm).squaredNorm();
}

void set_session(Case& c, bool lag, llmt::Random& random) {
  constexpr std::array<int, 4> poses = {30, 60, 120, 200};
  constexpr std::array<double, 4> noise = {5e-3, 10e-3, 20e-3, 50e-3};
  c.options.poses = poses[random.below(4)];
  c.noise_mm = noise[random.below(4)];
  c.options.two_payloads = random.uniform() < 0.5;
  c.options.repeats = random.uniform() < 0.4 || c.order.dirty == "dwelled";
  c.options.dwelled = c.order.dirty == "dwelled";
  // Some controllers stop short without being wrong about it.
  c.options.read_back_jitter = (random.uniform() < 0.15 || lag) ? 1e-3 : 1e-4;
  c.sessions = make_sessions(c.described, scale_of(c.order.arm).payloads, c.options, random);
}

// Draws the hidden effects; false if they are of no use (a pair that cannot be seen).
bool hide(Case& c, const std::vector<std::string>& kinds, llmt::Random& random) {
  const Pieces pieces(c.arm);
  const ArmScale scale = scale_of(c.order.arm);
  const Session& session = c.sessions.measured;
  const GeometryFree free(c.arm, c.base, session);
  const Eigen::MatrixXd without = positions_mm(c.arm, c.base, {}, session);
  const bool pair = kinds.size() > 1;
  for (int attempt = 0; attempt < (pair ? 12 : 8); ++attempt) {
    c.hidden.clear();
    std::vector<const Hidden*> all;
    std::vector<Eigen::VectorXd> seen;
    for (const std::string& kind : kinds) {
      c.hidden.push_back({draw(kind, {c.arm, pieces, scale, session, c.base, random}), 0.0, 0.0, 0.0});
    }
    for (HiddenShare& share : c.hidden) {
      all.push_back(&share.effect);
      const Eigen::MatrixXd moved = positions_mm(c.arm, c.base, {&share.effect}, session) - without;
      share.rms_mm = rms(moved);
      seen.push_back(free(moved) / c.noise_mm);
      share.lambda = seen.back().squaredNorm();
    }
    if (!pair) {
      c.lambda = c.hidden[0].lambda;
      c.hidden[0].lambda_beyond_other = c.lambda;
      // Most cases shall be worth the tool's time, yet the invisible ones must not be missing.
      if (attempt == 7 || (c.lambda >= 15.0 && c.lambda <= 1e5) || random.uniform() < 0.2) return true;
      continue;
    }
    if (aliases(c.arm, c.hidden[0].effect, c.hidden[1].effect)) return false;
    const double dot = seen[0].dot(seen[1]);
    for (int k = 0; k < 2; ++k) {
      HiddenShare& share = c.hidden[k];
      share.lambda_beyond_other = share.lambda - dot * dot / seen[1 - k].squaredNorm();
    }
    const auto [low, high] = std::minmax(c.hidden[0].lambda, c.hidden[1].lambda);
    const double beyond = std::min(c.hidden[0].lambda_beyond_other, c.hidden[1].lambda_beyond_other);
    if (low < pair_lambda || beyond < beyond_lambda || high > 1e6 || low < pair_ratio * pair_ratio * high) continue;
    c.lambda = free(positions_mm(c.arm, c.base, all, session) - without).squaredNorm() / (c.noise_mm * c.noise_mm);
    return true;
  }
  return false;
}

// Student's t with 4 degrees of freedom, scaled to unit variance.
double heavy_tail(llmt::Random& random) {
  double chi2 = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double z = random.normal();
    chi2 += z * z;
  }
  return random.normal() / std::sqrt(chi2 / 4.0) / std::sqrt(2.0);
}

void measure(Case& c, llmt::Random& random) {
  std::vector<const Hidden*> all;
  for (const HiddenShare& share : c.hidden) all.push_back(&share.effect);
  c.measured_mm = positions_mm(c.arm, c.base, all, c.sessions.measured);
  c.held_out_mm = positions_mm(c.arm, c.base, all, c.sessions.held_out);
  c.fresh_mm = positions_mm(c.arm, c.base, all, c.sessions.fresh);
  const bool heavy = c.order.dirty == "heavy_tails";
  const auto noise = [&] { return c.noise_mm * (heavy ? heavy_tail(random) : random.normal()); };

  // Dwelling repeats see only part of what coming back would scatter; the rest is common to them.
  constexpr double own = 0.6;
  std::vector<Eigen::Vector3d> common(c.options.poses + 1, Eigen::Vector3d::Zero());
  for (Eigen::Vector3d& shift : common) shift = Eigen::Vector3d(noise(), noise(), noise()) * std::sqrt(1.0 - own * own);
  for (Eigen::Index i = 0; i < c.measured_mm.rows(); ++i) {
    const std::size_t row = i;
    const bool dwelled = c.options.dwelled && c.sessions.measured.returned[row];
    for (int k = 0; k < 3; ++k) c.measured_mm(i, k) += (dwelled ? own : 1.0) * noise();
    if (dwelled) c.measured_mm.row(i) += common[c.sessions.measured.pose[row]].transpose();
  }
  for (Eigen::Index i = 0; i < c.held_out_mm.rows(); ++i) {
    for (int k = 0; k < 3; ++k) c.held_out_mm(i, k) += noise();
  }
  if (c.order.dirty != "outliers") return;
  const auto rows = random.permutation(c.measured_mm.rows());
  const auto wanted = std::max<std::ptrdiff_t>(1, (3 * c.measured_mm.rows() + 50) / 100);
  for (std::ptrdiff_t k = 0; k < wanted; ++k) {
    const auto row = rows[k];
    Eigen::Vector3d way(random.normal(), random.normal(), c.arm.planar ? 0.0 : random.normal());
    c.measured_mm.row(row) += log_uniform(random, 10.0, 100.0) * c.noise_mm * way.normalized().transpose();
    c.outliers.push_back(static_cast<int>(row));
  }
  std::ranges::sort(c.outliers);
}

}  // namespace

std::string Order::name() const { return fmt::format("{}-{}{}-{}", arm, kind, dirty.empty() ? "" : "_" + dirty, seed); }

Case make_case(const Order& order) {
  llmt::Random random(order.seed);
  for (int attempt = 0; attempt < 60; ++attempt) {
    Case c;
    c.order = order;
    c.described = nominal_arm(order.arm);
    const std::vector<std::string> kinds = draw_kinds(order, c.described, random);
    const bool softness_known = std::ranges::any_of(kinds, needs_elastic_description);
    const bool soft = softness_known || (kinds.empty() && random.uniform() < 0.25);
    c.arm = build(c.described, random, soft);
    const auto has = [&](const char* kind) { return std::ranges::find(kinds, kind) != kinds.end(); };
    if (soft) make_elastic(c, has("payload_error") || has("gravity_tilt"), random);
    if (has("transmission_error_order") || has("transmission_error_gear")) {
      // An order that is no multiple of a known ratio must come without the ratio, one that is with it.
      constexpr std::array<double, 6> ratios = {100, 101, 120.5, 121, 80, 161};
      for (int j = 0; j < c.arm.size(); ++j) {
        const std::size_t index = j;
        const double ratio = has("transmission_error_order") ? 0.0 : ratios[random.below(ratios.size())];
        c.described.joints[index].gear_ratio = c.arm.joints[index].gear_ratio = ratio;
      }
    }
    set_session(c, has("read_back_lag"), random);
    if (soft) measure_softness(c);
    if (!kinds.empty() && !hide(c, kinds, random)) continue;
    measure(c, random);
    return c;
  }
  throw std::runtime_error(order.name() + ": no pair that could be seen in 60 attempts");
}

}  // namespace blind
