// Apart from the header because Eigen's decompositions in long double take seconds to compile.
#include "oracles/oracles.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <vector>

namespace oracle {

using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

long double rss(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  Matrix regressors(x.rows(), x.cols() + 1);
  regressors.col(0).setOnes();
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    const Eigen::Matrix<long double, Eigen::Dynamic, 1> column = x.col(j).cast<long double>();
    const Eigen::Matrix<long double, Eigen::Dynamic, 1> centred = column.array() - column.mean();
    const long double norm = centred.norm();
    regressors.col(j + 1) = norm > 0 ? Matrix(centred / norm) : Matrix(centred);
  }
  Eigen::CompleteOrthogonalDecomposition<Matrix> decomposition;
  decomposition.setThreshold(1e-10L);
  decomposition.compute(regressors);
  const Matrix target = y.cast<long double>();
  return (target - regressors * decomposition.solve(target)).squaredNorm();
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& regressors, const Eigen::VectorXd& y) {
  return regressors.colPivHouseholderQr().solve(y);
}

Split best_split(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, Eigen::Index min_leaf, long double tie_tolerance) {
  const long double tolerance = tie_tolerance * rss(x, y);
  Split best;
  for (int j = 0; j < x.cols(); ++j) {
    std::vector<double> values(x.col(j).begin(), x.col(j).end());
    std::ranges::sort(values);
    values.erase(std::unique(values.begin(), values.end()), values.end());
    for (std::size_t k = 0; k + 1 < values.size(); ++k) {
      std::vector<int> left;
      std::vector<int> right;
      for (int row = 0; row < x.rows(); ++row) {
        (x(row, j) <= values[k] ? left : right).push_back(row);
      }
      if (std::ssize(left) < min_leaf || std::ssize(right) < min_leaf) continue;
      const long double total =
          rss(x(left, Eigen::all), y(left, Eigen::all)) + rss(x(right, Eigen::all), y(right, Eigen::all));
      if (total < best.rss - tolerance) {
        best = {j, values[k], values[k + 1], total};
      }
    }
  }
  return best;
}

}  // namespace oracle
