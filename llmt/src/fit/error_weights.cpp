#include "fit/error_weights.hpp"

#include <numeric>

namespace llmt {

std::vector<std::vector<int>> output_groups(Eigen::Index outputs, bool shared) {
  std::vector<int> all(outputs);
  std::iota(all.begin(), all.end(), 0);
  if (shared) return {all};
  std::vector<std::vector<int>> groups;
  for (const int output : all) groups.push_back({output});
  return groups;
}

Eigen::VectorXd error_weights(const Table& table, const std::vector<int>& served) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(std::ssize(served));
  for (std::size_t o = 0; o < served.size() && served.size() > 1; ++o) {
    const auto output = table.outputs.col(served[o]).array();
    const double variance = (output - output.mean()).square().mean();
    weights(o) = variance > 0.0 ? 1.0 / variance : 1.0;
  }
  return weights;
}

}  // namespace llmt
