// Where deviations change their size.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "discovery/answer/contests.hpp"

namespace llmt::discovery {
namespace {

struct GateAt {
  double log_likelihood = 0.0;
  double threshold = 0.0;
};

// The place of an input beyond which squares have another mean: least negative logarithm of the likelihood of two
// normal distributions.
GateAt best_gate(const Eigen::VectorXd& x, const Eigen::VectorXd& squares) {
  constexpr Eigen::Index fewest_share = 20;  // at least a twentieth of the samples is on each side
  const Eigen::Index n = x.size();
  std::vector<Eigen::Index> order(n);
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return x(i); });
  const double all = squares.sum();
  const auto log_variance = [](double sum, Eigen::Index count) {
    return static_cast<double>(count) * std::log(sum / static_cast<double>(count));
  };
  GateAt best;
  double below = 0.0;
  for (Eigen::Index k = 1; k < n; ++k) {
    below += squares(order[k - 1]);
    if (k < n / fewest_share || n - k < n / fewest_share || !(x(order[k]) > x(order[k - 1]))) continue;
    const double own = 0.5 * (log_variance(all, n) - log_variance(below, k) - log_variance(all - below, n - k));
    if (own > best.log_likelihood) best = {own, 0.5 * (x(order[k - 1]) + x(order[k]))};
  }
  return best;
}

}  // namespace

Gates gates_of_size(const CrossValidation& validation, const Missing& found) {
  constexpr std::size_t most = 2;
  constexpr double surprising = 10.0;
  constexpr Eigen::Index fewest = 40;
  const Samples& samples = validation.data().samples;
  const Inputs& inputs = validation.recording().inputs();
  Gates gates;
  if (samples.size() < fewest) return gates;
  const Eigen::MatrixXd values = means(inputs.values, samples);
  const Eigen::MatrixXd deviations = validation.data().measured - means_of_filtered(found.before, samples);
  std::vector<std::pair<GateAt, Eigen::Index>> places;
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    if (inputs.names[j] == inputs.order) continue;
    for (Eigen::Index o = 0; o < deviations.cols(); ++o) {
      const double noise = found.gaps[o].noise_floor;
      const GateAt place = best_gate(values.col(j), deviations.col(o).array().square() + noise * noise);
      if (place.log_likelihood > surprising) places.emplace_back(place, j);
    }
  }
  std::ranges::stable_sort(places, std::greater<>{}, [](const auto& own) { return own.first.log_likelihood; });
  for (const auto& [place, j] : places) {
    if (gates.size() < most) gates.try_emplace(inputs.names[j], place.threshold);
  }
  return gates;
}

}  // namespace llmt::discovery
