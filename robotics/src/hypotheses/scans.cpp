#include "hypotheses/scans.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace llmt::robotics {

namespace {

struct Peak {
  double order;
  double gain;
};

double order_gain(const JointSignal& signal, double order) {
  Eigen::Matrix2d gram = Eigen::Matrix2d::Zero();
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < signal.angle.size(); ++i) {
    const Eigen::Vector2d wave(std::cos(order * signal.angle[i]), std::sin(order * signal.angle[i]));
    gram += signal.weight[i] * wave * wave.transpose();
    moment += signal.along[i] * wave;
  }
  return gram.determinant() > 1e-6 * gram.trace() * gram.trace() ? moment.dot(gram.ldlt().solve(moment)) : 0.0;
}

// Sum of squares of the residuals' parts along the joint's motion.
double along_square(const JointSignal& signal) {
  double sum = 0.0;
  for (std::size_t i = 0; i < signal.along.size(); ++i) {
    if (signal.weight[i] > 0.0) sum += signal.along[i] * signal.along[i] / signal.weight[i];
  }
  return sum;
}

// The gain on a grid of orders, with cosines and sines by rotation from order to order.
std::vector<Peak> order_spectrum(const JointSignal& signal, double first, double last, double step) {
  std::vector<Peak> spectrum;
  const auto n = std::ssize(signal.angle);
  const Eigen::Map<const Eigen::ArrayXd> angle(signal.angle.data(), n);
  const Eigen::Map<const Eigen::ArrayXd> along(signal.along.data(), n);
  const Eigen::Map<const Eigen::ArrayXd> weight(signal.weight.data(), n);
  Eigen::ArrayXd cosine = (first * angle).cos();
  Eigen::ArrayXd sine = (first * angle).sin();
  const Eigen::ArrayXd turn_cosine = (step * angle).cos();
  const Eigen::ArrayXd turn_sine = (step * angle).sin();
  Eigen::ArrayXd next(n);
  for (double order = first; order <= last; order += step) {
    const double cc = (weight * cosine * cosine).sum();
    const double cs = (weight * cosine * sine).sum();
    const double ss = (weight * sine * sine).sum();
    const double c = (along * cosine).sum();
    const double s = (along * sine).sum();
    const double determinant = cc * ss - cs * cs;
    const double gain =
        determinant > 1e-6 * (cc + ss) * (cc + ss) ? (ss * c * c - 2.0 * cs * c * s + cc * s * s) / determinant : 0.0;
    spectrum.push_back({order, gain});
    next = cosine * turn_cosine - sine * turn_sine;
    sine = sine * turn_cosine + cosine * turn_sine;
    cosine = next;
  }
  return spectrum;
}

// The order of the largest gain near a peak, or the whole number beside it if that explains the residuals as well but
// for chance: gears have whole numbers of teeth, or twice their ratio's.
double refined(const JointSignal& signal, double order, double step) {
  double best = order;
  double gain = order_gain(signal, order);
  for (double width = 0.5 * step; width > 0.02 * step; width *= 0.5) {
    const double centre = best;
    for (const double trial : {centre - width, centre + width}) {
      const double own = order_gain(signal, trial);
      if (own > gain) {
        gain = own;
        best = trial;
      }
    }
  }
  constexpr double chance = 6.0;  // of chi-squared with one degree of freedom: one time in seventy
  const double variance = std::max(0.0, along_square(signal) - gain) / static_cast<double>(signal.along.size());
  const double whole = std::round(best);
  return std::abs(whole - best) < step && gain - order_gain(signal, whole) < chance * variance ? whole : best;
}

// Scatter of one joint is larger along its motion than what the search takes for noise, and the best of many orders
// would be an effect. It must stand out of that joint's own scatter.
bool stands_out(const JointSignal& signal, double gain, double orders) {
  const double variance = std::max(0.0, along_square(signal) - gain) / static_cast<double>(signal.along.size());
  constexpr double clearly = 12.0;  // the best of the orders of one joint reaches it one time in four hundred
  return gain > (2.0 * std::log(orders) + clearly) * variance;
}

Hypothesis hypothesis_of(const EffectType& type, const Chain& chain, std::size_t index, double constant,
                         double choices) {
  Hypothesis hypothesis;
  hypothesis.effect = make_effect(type, chain, index, {constant});
  hypothesis.candidate.family = type.family;
  hypothesis.candidate.location =
      fmt::format("{}[{:.2f}]", type.place == EffectPlace::robot ? "" : chain.joints[index].name, constant);
  set_limits(type, std::ssize(hypothesis.effect->values), hypothesis.candidate);
  hypothesis.candidate.prior_cost = 2.0 * std::log(choices);
  return hypothesis;
}

void add_orders(const Scene& scene, const EffectType& type, std::vector<Hypothesis>& hypotheses) {
  // Lower orders are covered by the eccentricities of the catalogue and by the smooth patterns.
  constexpr double lowest = 2.6;
  constexpr double highest = 450.0;
  constexpr std::size_t kept = 2;
  const Chain& chain = scene.robot.chain;
  for (std::size_t j = 0; j < chain.joints.size(); ++j) {
    if (!suits(type, chain, j)) continue;
    const JointSignal signal = joint_signal(scene, j);
    const double range = signal.high - signal.low;
    if (signal.angle.size() < 12 || range < 0.2) continue;
    const double step = 1.2 / range;
    std::vector<Peak> spectrum = order_spectrum(signal, lowest, highest, step);
    const double choices = static_cast<double>(spectrum.size() * chain.joints.size());
    std::ranges::sort(spectrum, std::greater<>{}, &Peak::gain);
    std::vector<double> taken;
    for (const std::vector<double>& constants : constants_to_try(type, scene.trial(), j)) taken.push_back(constants[0]);
    const std::size_t known = taken.size();
    for (const Peak& peak : spectrum) {
      if (taken.size() >= known + kept) break;
      if (std::ranges::any_of(taken, [&](double order) { return std::abs(order - peak.order) < 3.0 * step; })) continue;
      taken.push_back(peak.order);
      if (!stands_out(signal, peak.gain, static_cast<double>(spectrum.size()))) continue;
      const double order = refined(signal, peak.order, step);
      hypotheses.push_back(hypothesis_of(type, chain, j, order, choices));
    }
  }
}

void add_jumps(const Scene& scene, const EffectType& type, std::vector<Hypothesis>& hypotheses) {
  const auto column = [&](const char* name) {
    const auto found = scene.poses.covariates.find(name);
    return found == scene.poses.covariates.end() ? nullptr : &found->second;
  };
  const Eigen::VectorXd* time = column("order") != nullptr ? column("order") : column("time_s");
  if (time == nullptr) return;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < time->size(); ++i) rows.push_back(i);
  std::ranges::stable_sort(rows, {}, [&](Eigen::Index i) { return (*time)(i); });
  const auto n = static_cast<double>(rows.size());
  std::vector<Peak> cuts;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  Eigen::Vector3d total = Eigen::Vector3d::Zero();
  for (const Eigen::Index i : rows) total += scene.clipped.segment(3 * i, 3);
  constexpr std::size_t least = 3;
  for (std::size_t k = 0; k + 1 < rows.size(); ++k) {
    before += scene.clipped.segment(3 * rows[k], 3);
    const double first = (*time)(rows[k]);
    const double second = (*time)(rows[k + 1]);
    if (k + 1 < least || k + 1 + least > rows.size() || !(second > first)) continue;
    const double m = static_cast<double>(k + 1);
    cuts.push_back({0.5 * (first + second), (before - m / n * total).squaredNorm() * n / (m * (n - m))});
  }
  const double choices = std::max(1.0, static_cast<double>(cuts.size()));
  std::ranges::stable_sort(cuts, std::greater<>{}, &Peak::gain);
  for (std::size_t k = 0; k < std::min<std::size_t>(3, cuts.size()); ++k) {
    hypotheses.push_back(hypothesis_of(type, scene.robot.chain, 0, cuts[k].order, choices));
  }
}

}  // namespace

std::vector<Hypothesis> scanned_effects(const Scene& scene, const std::vector<EffectType>& catalogue) {
  std::vector<Hypothesis> hypotheses;
  for (const EffectType& type : catalogue) {
    if (!type.searched) continue;
    if (type.nature == Nature::wave) add_orders(scene, type, hypotheses);
    if (type.nature == Nature::jump) add_jumps(scene, type, hypotheses);
  }
  std::vector<Hypothesis> fresh;
  for (Hypothesis& hypothesis : hypotheses) {
    const std::string label = effect_label(*hypothesis.effect);
    const bool present =
        std::ranges::any_of(scene.robot.effects, [&](const Effect& e) { return effect_label(e) == label; });
    if (!present) fresh.push_back(std::move(hypothesis));
  }
  return fresh;
}

}  // namespace llmt::robotics
