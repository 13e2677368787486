#include "explain/coalitions.hpp"

#include <algorithm>
#include <bit>

namespace llmt {

namespace {

// v of all coalitions, bit k of whose number says whether used[k] is a member. A background of many rows is taken in
// parts, for which the mixed rows take little memory.
Eigen::VectorXd values_of_coalitions(const BoostedModel& model, const std::vector<int>& used, const Eigen::VectorXd& x,
                                     const Eigen::MatrixXd& background, Work& work) {
  constexpr Eigen::Index rows_at_once = 4096;
  const auto coalitions = Eigen::Index{1} << used.size();
  const Eigen::Index at_once = std::max<Eigen::Index>(1, rows_at_once / coalitions);
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(coalitions);
  for (Eigen::Index first = 0; first < background.cols(); first += at_once) {
    work.check();
    const Eigen::Index count = std::min(at_once, background.cols() - first);
    Eigen::MatrixXd rows(count * coalitions, x.size());
    for (Eigen::Index row = 0; row < rows.rows(); ++row) {
      rows.row(row) = background.col(first + row / coalitions).transpose();
      for (std::size_t k = 0; k < used.size(); ++k) {
        if ((row % coalitions >> k & 1) != 0) rows(row, used[k]) = x(used[k]);
      }
    }
    const Eigen::VectorXd predictions = model.predict(rows, 1).col(0);
    sums += Eigen::Map<const Eigen::MatrixXd>(predictions.data(), coalitions, count).rowwise().sum();
  }
  return sums / static_cast<double>(background.cols());
}

}  // namespace

Eigen::VectorXd shapley_values(const BoostedModel& model, const std::vector<int>& used, const Eigen::VectorXd& x,
                               const Eigen::MatrixXd& background, Work& work) {
  const auto n = static_cast<int>(used.size());
  const unsigned coalitions = 1u << n;
  const Eigen::VectorXd v = values_of_coalitions(model, used, x, background, work);
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
