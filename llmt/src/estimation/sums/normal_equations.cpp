#include "estimation/sums/normal_equations.hpp"

namespace llmt {

Eigen::MatrixXd NormalEquations::block(std::size_t i, int j) const {
  Eigen::MatrixXd result(size, size);
  const double* values = blocks[i].at(j).data();
  for (Eigen::Index r = 0; r < size; ++r) {
    for (Eigen::Index c = 0; c < (missing ? size : r + 1); ++c) {
      result(r, c) = *values++;
      if (!missing) {
        result(c, r) = result(r, c);
      }
    }
  }
  return result;
}

}  // namespace llmt
