// Apart from the header because Eigen's decompositions in long double take seconds to compile.
#include "oracles/oracles.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <numeric>
#include <vector>

namespace oracle {

using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

namespace {

Matrix scaled(const Eigen::MatrixXd& x) {
  Matrix regressors(x.rows(), x.cols() + 1);
  regressors.col(0).setOnes();
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    const Eigen::Matrix<long double, Eigen::Dynamic, 1> column = x.col(j).cast<long double>();
    const Eigen::Matrix<long double, Eigen::Dynamic, 1> centred = column.array() - column.mean();
    const long double norm = centred.norm();
    regressors.col(j + 1) = norm > 0 ? Matrix(centred / norm) : Matrix(centred);
  }
  return regressors;
}

Eigen::CompleteOrthogonalDecomposition<Matrix> decompose(const Matrix& regressors) {
  Eigen::CompleteOrthogonalDecomposition<Matrix> decomposition;
  decomposition.setThreshold(1e-10L);
  decomposition.compute(regressors);
  return decomposition;
}

}  // namespace

long double rss(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  const Matrix regressors = scaled(x);
  const Matrix target = y.cast<long double>();
  return (target - regressors * decompose(regressors).solve(target)).squaredNorm();
}

int rank(const Eigen::MatrixXd& x) { return static_cast<int>(decompose(scaled(x)).rank()); }

long double adjusted_rss(const WholeNode& node, long double rss, const Side& left, const Side& right) {
  long double ranks = 0;
  for (const Side& side : {left, right}) ranks += side.rows < 2 * node.rank ? node.rank : side.rank;
  const auto score = [&](long double coefficients) { return 1.0L / (node.rows - coefficients); };
  return node.rows > 2 * node.rank ? rss * score(ranks) / score(2.0L * node.rank) : rss;
}

bool two_rows_decide(const WholeNode& node, const Side& side, const Side& without) {
  return side.rows >= 2 * node.rank && without.rank < side.rank;
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& regressors, const Eigen::VectorXd& y) {
  return regressors.colPivHouseholderQr().solve(y);
}

Split best_split(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, Eigen::Index min_leaf, long double tie_tolerance) {
  const WholeNode node{static_cast<double>(x.rows()), rank(x), rss(x, y)};
  const long double tolerance = tie_tolerance * node.rss;
  Split best;
  for (int j = 0; j < x.cols(); ++j) {
    std::vector<int> order(x.rows());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, [&](int row) { return x(row, j); });
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(min_leaf, 1); k <= x.rows() - min_leaf && k < x.rows(); ++k) {
      const double low = x(order[k - 1], j);
      const double high = x(order[k], j);
      if (low == high) continue;
      const std::vector<int> left(order.begin(), order.begin() + k);
      const std::vector<int> right(order.begin() + k, order.end());
      const long double total =
          rss(x(left, Eigen::all), y(left, Eigen::all)) + rss(x(right, Eigen::all), y(right, Eigen::all));
      const auto side_of = [&](std::vector<int> rows, std::size_t less) {
        rows.resize(rows.size() - std::min(rows.size(), less));
        return Side{std::ssize(rows), rows.empty() ? 0 : rank(x(rows, Eigen::all))};
      };
      const std::vector<int> inwards(right.rbegin(), right.rend());
      const long double adjusted = adjusted_rss(node, total, side_of(left, 0), side_of(right, 0));
      if (adjusted < best.adjusted - tolerance && !two_rows_decide(node, side_of(left, 0), side_of(left, 2)) &&
          !two_rows_decide(node, side_of(inwards, 0), side_of(inwards, 2))) {
        best = {j, low, high, total, adjusted};
      }
    }
  }
  return best;
}

}  // namespace oracle
