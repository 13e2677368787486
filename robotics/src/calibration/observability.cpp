#include "llmt/robotics/observability.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace llmt::robotics {

Observability observability(const Eigen::VectorXd& singular_values, Eigen::Index poses) {
  if (singular_values.size() == 0 || !singular_values.allFinite() || singular_values.minCoeff() < 0.0) {
    throw std::invalid_argument("llmt::robotics::observability: singular values must be there, finite, and 0 or more");
  }
  if (poses < 1) {
    throw std::invalid_argument(fmt::format("llmt::robotics::observability: poses is {}, must be >= 1", poses));
  }
  const double largest = singular_values.maxCoeff();
  const double smallest = singular_values.minCoeff();
  Observability result;
  result.parameters = singular_values.size();
  result.condition = std::numeric_limits<double>::infinity();
  if (!(smallest > 0.0)) return result;
  result.o1 = std::exp(singular_values.array().log().mean()) / std::sqrt(static_cast<double>(poses));
  result.o2 = smallest / largest;
  result.o3 = smallest;
  result.o4 = smallest * smallest / largest;
  result.o5 = 1.0 / singular_values.cwiseInverse().sum();
  result.condition = largest / smallest;
  return result;
}

}  // namespace llmt::robotics
