#include "llmt/crps.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace llmt {

std::vector<double> crps_probabilities(int count) {
  std::vector<double> probabilities;
  for (int k = 0; k < count; ++k) probabilities.push_back((k + 0.5) / count);
  return probabilities;
}

Eigen::VectorXd crps(const Eigen::Ref<const Eigen::MatrixXd>& quantiles,
                     const Eigen::Ref<const Eigen::VectorXd>& observed) {
  if (quantiles.cols() == 0 || quantiles.rows() != observed.size()) {
    throw std::invalid_argument(
        fmt::format("llmt::crps: quantiles are {} x {}, {} rows and at least 1 column are needed", quantiles.rows(),
                    quantiles.cols(), observed.size()));
  }
  const std::vector<double> probabilities = crps_probabilities(static_cast<int>(quantiles.cols()));
  Eigen::VectorXd scores = Eigen::VectorXd::Zero(observed.size());
  for (Eigen::Index row = 0; row < scores.size(); ++row) {
    for (Eigen::Index k = 0; k < quantiles.cols(); ++k) {
      const double above = quantiles(row, k) - observed(row);
      scores(row) += ((above > 0.0 ? 1.0 : 0.0) - probabilities[static_cast<std::size_t>(k)]) * above;
    }
  }
  return scores * 2.0 / static_cast<double>(quantiles.cols());
}

}  // namespace llmt
