#include "discovery/terms/correlation.hpp"

#include <algorithm>
#include <cmath>

namespace llmt::discovery {
namespace {

struct Lagged {
  double product = 0.0;  // mean over the pairs
  double pairs = 0.0;
};

Lagged lagged(const Eigen::VectorXd& values, const std::vector<Eigen::Index>& stretches, const std::vector<bool>& used,
              Eigen::Index lag) {
  Lagged result;
  for (Eigen::Index i = 0; i + lag < values.size(); ++i) {
    if (stretches[i] != stretches[i + lag] || !used[i] || !used[i + lag]) continue;
    result.product += values(i) * values(i + lag);
    result.pairs += 1.0;
  }
  if (result.pairs > 0.0) result.product /= result.pairs;
  return result;
}

}  // namespace

std::vector<double> autocorrelation(const Eigen::VectorXd& values, const std::vector<Eigen::Index>& stretches,
                                    const std::vector<bool>& used) {
  std::vector<double> correlation;
  const double variance = lagged(values, stretches, used, 0).product;
  if (!(variance > 0.0)) return correlation;
  const Eigen::Index most = values.size() / 4;
  for (Eigen::Index lag = 1; lag <= most; ++lag) {
    const Lagged own = lagged(values, stretches, used, lag);
    constexpr double significant = 1.65;
    constexpr double fewest_pairs = 10.0;
    if (own.pairs < fewest_pairs) break;
    const double rho = own.product / variance;
    if (rho < significant / std::sqrt(own.pairs)) break;
    correlation.push_back(std::min(1.0, rho));
  }
  return correlation;
}

double independent_share(const std::vector<double>& correlation) {
  double sum = 1.0;
  for (const double rho : correlation) sum += 2.0 * rho;
  return 1.0 / sum;
}

double variance_inflation(const std::vector<double>& correlation, const Eigen::VectorXd& influences,
                          const std::vector<Eigen::Index>& stretches) {
  const std::vector<bool> all(influences.size(), true);
  const double own = lagged(influences, stretches, all, 0).product;
  double sum = 1.0;
  for (std::size_t k = 0; k < correlation.size() && own > 0.0; ++k) {
    const double r = lagged(influences, stretches, all, static_cast<Eigen::Index>(k) + 1).product / own;
    sum += 2.0 * correlation[k] * r;
  }
  return std::max(1.0, sum);
}

}  // namespace llmt::discovery
