/// \file
/// Gauss-Legendre quadrature.
#pragma once

#include <vector>

namespace llmt {

/// Exact for polynomials of degree 2 * order - 1 on 0 ... 1.
struct Quadrature {
  std::vector<double> nodes;
  std::vector<double> weights;
};

/// The rule of any order from 1; its computation takes a time in proportion to the square of the order.
Quadrature gauss_legendre(int order);

/// The rule of an order from 1 to 16; others are clamped.
const Quadrature& quadrature(int order);

}  // namespace llmt
