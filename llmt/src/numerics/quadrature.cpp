#include "numerics/quadrature.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace llmt {
// The zeros of the Legendre polynomial, by Newton's method.
Quadrature gauss_legendre(int order) {
  Quadrature rule;
  for (int i = 1; i <= order; ++i) {
    double z = std::cos(std::numbers::pi * (i - 0.25) / (order + 0.5));
    double derivative = 1.0;
    for (int iteration = 0; iteration < 20; ++iteration) {
      double value = 1.0;
      double before = 0.0;
      for (int k = 1; k <= order; ++k) {
        const double next = ((2.0 * k - 1.0) * z * value - (k - 1.0) * before) / k;
        before = value;
        value = next;
      }
      derivative = order * (z * value - before) / (z * z - 1.0);
      z -= value / derivative;
    }
    rule.nodes.push_back(0.5 * (1.0 - z));
    rule.weights.push_back(1.0 / ((1.0 - z * z) * derivative * derivative));
  }
  return rule;
}

namespace {

constexpr int highest_order = 16;

}  // namespace

const Quadrature& quadrature(int order) {
  static const std::array<Quadrature, highest_order> rules = [] {
    std::array<Quadrature, highest_order> all;
    for (int k = 0; k < highest_order; ++k) {
      all[k] = gauss_legendre(k + 1);
    }
    return all;
  }();
  return rules[std::clamp(order, 1, highest_order) - 1];
}

}  // namespace llmt
