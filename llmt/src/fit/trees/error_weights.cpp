#include "fit/trees/error_weights.hpp"

#include <numeric>

#include "base/sum_over.hpp"

namespace llmt {

std::vector<std::vector<int>> output_groups(Eigen::Index outputs, bool shared) {
  std::vector<int> all(outputs);
  std::iota(all.begin(), all.end(), 0);
  if (shared) return {all};
  std::vector<std::vector<int>> groups;
  for (const int output : all) groups.push_back({output});
  return groups;
}

double variance_of(const Eigen::Ref<const Eigen::VectorXd>& values) {
  const auto mean_of = [&](const auto& term) {
    return sum_of_rows(values.size(), term) / static_cast<double>(values.size());
  };
  const double mean = mean_of([&](Eigen::Index i) { return values(i); });
  return mean_of([&](Eigen::Index i) { return (values(i) - mean) * (values(i) - mean); });
}

Eigen::VectorXd error_weights(const Table& table, const std::vector<int>& served) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(std::ssize(served));
  for (std::size_t o = 0; o < served.size() && served.size() > 1; ++o) {
    const double variance = variance_of(table.outputs.col(served[o]));
    weights(o) = variance > 0.0 ? 1.0 / variance : 1.0;
  }
  return weights;
}

}  // namespace llmt
