#include "explain/coalitions.hpp"

#include <bit>

namespace llmt {

Eigen::VectorXd shapley_values(const BoostedModel& model, const std::vector<int>& used, const Eigen::VectorXd& x,
                               const Eigen::MatrixXd& background) {
  const auto n = static_cast<int>(used.size());
  const unsigned coalitions = 1u << n;
  Eigen::MatrixXd rows(background.cols() * static_cast<Eigen::Index>(coalitions), x.size());
  Eigen::Index row = 0;
  for (Eigen::Index b = 0; b < background.cols(); ++b) {
    for (unsigned members = 0; members < coalitions; ++members, ++row) {
      rows.row(row) = background.col(b).transpose();
      for (int k = 0; k < n; ++k) {
        if ((members >> k & 1u) != 0) rows(row, used[k]) = x(used[k]);
      }
    }
  }
  const Eigen::VectorXd predictions = model.predict(rows, 1).col(0);
  const Eigen::VectorXd v =
      Eigen::Map<const Eigen::MatrixXd>(predictions.data(), coalitions, background.cols()).rowwise().mean();
  std::vector<double> weights(n);  // of a coalition, by the number of its members
  for (int size = 0; size < n; ++size) {
    weights[size] = 1.0 / n;  // 1 / (n times the number of coalitions of n - 1 inputs with so many members)
    for (int k = 1; k <= size; ++k) weights[size] *= static_cast<double>(k) / (n - k);
  }
  Eigen::VectorXd values = Eigen::VectorXd::Zero(x.size());
  for (unsigned members = 0; members < coalitions; ++members) {
    for (int k = 0; k < n; ++k) {
      if ((members >> k & 1u) != 0) continue;
      values(used[k]) += weights[std::popcount(members)] * (v(members | 1u << k) - v(members));
    }
  }
  return values;
}

}  // namespace llmt
