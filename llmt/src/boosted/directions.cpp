#include "boosted/directions.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "boosted/model/boosted_checks.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index most_points = 1000;  // gradients are averaged, so that few rows are enough
constexpr double half_step = 0.2;           // standard deviations, to both sides: soft splits are as wide

// The trees of a race at any inputs.
class Trees {
 public:
  Trees(const std::vector<GrowingTree>& trees, const BinnedRows& rows, const BoostingData& data)
      : rows_(rows), data_(data), z_(rows.features.size()) {
    for (const GrowingTree& tree : trees) trees_.push_back(finished(tree, rows));
  }

  double at(const Eigen::VectorXd& x) {
    for (std::size_t k = 0; k < z_.size(); ++k) {
      z_[k] = feature_at(rows_.features[k].feature, data_.inputs, data_.deviations, x.data());
    }
    double sum = 0.0;
    for (const BoostedTree& tree : trees_) sum += value_of(tree, z_.data());
    return sum;
  }

 private:
  const BinnedRows& rows_;
  const BoostingData& data_;
  std::vector<BoostedTree> trees_;
  std::vector<double> z_;
};

// Three digits, so that last bits of the eigenvectors do not reach the model, and no factor below.
BoostedFeature rounded(const Eigen::VectorXd& direction, const std::vector<int>& inputs) {
  constexpr double digits = 1000.0;
  constexpr double least = 0.05;
  std::vector<int> order;
  for (int k = 0; k < direction.size(); ++k) {
    if (std::abs(direction(k)) >= least) order.push_back(k);
  }
  std::ranges::stable_sort(order, std::greater{}, [&](int k) { return std::abs(std::round(digits * direction(k))); });
  const double sign = direction(order.front()) < 0.0 ? -1.0 : 1.0;
  BoostedFeature feature{.inputs = {}, .factors = {}};
  for (const int k : order) {
    feature.inputs.push_back(inputs[k]);
    feature.factors.push_back(sign * std::round(digits * direction(k)) / digits);
  }
  return feature;
}

}  // namespace

std::vector<BoostedFeature> directions_of(const std::vector<GrowingTree>& trees, const BinnedRows& rows,
                                          const BoostingData& data, const std::vector<int>& inputs) {
  Trees sum(trees, rows, data);
  const auto count = std::ssize(inputs);
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(count, count);
  const Eigen::Index all = data.x.rows();
  const Eigen::Index taken = std::min(all, most_points);
  for (Eigen::Index k = 0; k < taken; ++k) {
    const Eigen::Index i = k * all / taken;
    Eigen::VectorXd x = data.x.row(i);
    if (x(inputs).hasNaN()) continue;
    Eigen::VectorXd gradient(count);
    for (Eigen::Index j = 0; j < count; ++j) {
      const int input = inputs[j];
      const double here = x(input);
      x(input) = here + half_step * data.deviations[input];
      const double above = sum.at(x);
      x(input) = here - half_step * data.deviations[input];
      gradient(j) = above - sum.at(x);
      x(input) = here;
    }
    products += rows.weights(i) * gradient * gradient.transpose();
  }
  std::vector<BoostedFeature> directions;
  if (!(products.trace() > 0.0)) return directions;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(products);
  for (Eigen::Index k = count - 1; k >= 0; --k) {
    BoostedFeature direction = rounded(eigen.eigenvectors().col(k), inputs);
    if (direction.inputs.size() > 1) directions.push_back(std::move(direction));
  }
  return directions;
}

}  // namespace llmt
