// Tests of residuals that should be noise: do they still depend on inputs?
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "discovery/answer/judges.hpp"
#include "discovery/recording/samples.hpp"

namespace llmt::discovery {
namespace {

struct Pairing {
  double sum = 0.0;
  double variance = 0.0;
  double pairs = 0.0;

  void add(double a, double b, double weight) {
    sum += weight * a * b;
    variance += weight * weight * a * a * b * b;
    pairs += weight;
  }
  double p_value(double inflation) const {
    return variance > 0.0 ? 0.5 * std::erfc(sum / std::sqrt(2.0 * variance * inflation)) : 1.0;
  }
};

// The variance of a sum of products of two stretches whose errors are correlated by r_m at m places, as a multiple of
// that of independent errors: 1 + 2 sum_m r_m^2 (Bartlett 1935). Less what chance adds to r_m^2.
double inflation_of_products(const Eigen::VectorXd& errors, const std::vector<Eigen::Index>& stretches) {
  constexpr Eigen::Index most = 3;  // places
  double inflation = 1.0;
  for (Eigen::Index m = 1; m <= most && !stretches.empty(); ++m) {
    double products = 0.0;
    double squares = 0.0;
    double pairs = 0.0;
    for (Eigen::Index i = 0; i + m < errors.size(); ++i) {
      if (stretches[i] != stretches[i + m]) continue;
      products += errors(i) * errors(i + m);
      squares += 0.5 * (errors(i) * errors(i) + errors(i + m) * errors(i + m));
      pairs += 1.0;
    }
    if (squares > 0.0) inflation += 2.0 * std::max(0.0, std::pow(products / squares, 2.0) - 1.0 / pairs);
  }
  return inflation;
}

// Samples whose noise may be alike are no pair.
class Separate {
 public:
  Separate(const std::vector<Eigen::Index>& stretches, double independent_share)
      : stretches_(&stretches), apart_(static_cast<Eigen::Index>(std::ceil(2.0 / independent_share))) {}

  bool operator()(Eigen::Index i, Eigen::Index k) const {
    return stretches_->empty() || (*stretches_)[i] != (*stretches_)[k] || std::abs(i - k) > apart_;
  }

 private:
  const std::vector<Eigen::Index>* stretches_;
  Eigen::Index apart_;
};

Pairing along(const Eigen::VectorXd& input, const Eigen::VectorXd& errors, const Separate& apart) {
  std::vector<Eigen::Index> order(input.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return input(i); });
  Pairing pairing;
  constexpr std::size_t farthest = 5;  // places
  for (std::size_t k = 0; k + 1 < order.size(); ++k) {
    for (std::size_t m = k + 1; m < std::min(order.size(), k + 1 + farthest); ++m) {
      if (!apart(order[k], order[m])) continue;
      pairing.add(errors(order[k]), errors(order[m]), 1.0);
      break;
    }
  }
  return pairing;
}

// Nearest neighbours; `inputs` scaled to equal spread.
Pairing nearest(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& errors, const Separate& apart) {
  const Eigen::Index n = inputs.rows();
  std::vector<Eigen::Index> neighbour(n, -1);
  const Eigen::MatrixXd points = inputs.transpose();
  for (Eigen::Index i = 0; i < n; ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index k = 0; k < n; ++k) {
      const double distance = (points.col(i) - points.col(k)).squaredNorm();
      if (k == i || distance >= least || !apart(i, k)) continue;
      least = distance;
      neighbour[i] = k;
    }
  }
  Pairing pairing;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index k = neighbour[i];
    if (k < 0) continue;
    const bool mutual = neighbour[k] == i;
    if (!mutual || i < k) pairing.add(errors(i), errors(k), 1.0);
  }
  return pairing;
}

}  // namespace

StructureLeft structure_left(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& errors,
                             const std::vector<Eigen::Index>& stretches, double independent_share) {
  const Separate apart(stretches, independent_share);
  const double inflation = std::max(1.0 / independent_share, inflation_of_products(errors, stretches));
  constexpr Eigen::Index fewest = 20;
  constexpr double most_work = 2e8;  // distances
  StructureLeft best;
  if (errors.size() < fewest || !(errors.squaredNorm() > 0.0)) return best;
  std::vector<Eigen::Index> moving;
  Eigen::MatrixXd scaled = inputs;
  for (Eigen::Index j = 0; j < inputs.cols(); ++j) {
    const double range = inputs.col(j).maxCoeff() - inputs.col(j).minCoeff();
    if (!(range > 0.0)) continue;
    scaled.col(j) /= range;
    moving.push_back(j);
  }
  double tests = 0.0;
  const auto consider = [&](const std::vector<Eigen::Index>& columns, const Pairing& pairing) {
    tests += 1.0;
    const double p = pairing.p_value(inflation);
    if (p >= best.p_value) return;
    const double common = pairing.sum / std::max(1.0, pairing.pairs);
    best = {columns, p, std::clamp(common * static_cast<double>(errors.size()) / errors.squaredNorm(), 0.0, 1.0)};
  };
  for (const Eigen::Index j : moving) consider({j}, along(scaled.col(j), errors, apart));
  const double work = static_cast<double>(errors.size()) * static_cast<double>(errors.size());
  const double pairs = 0.5 * static_cast<double>(moving.size()) * static_cast<double>(moving.size() - 1);
  if (moving.size() > 1 && work * pairs <= most_work) {
    for (std::size_t a = 0; a < moving.size(); ++a) {
      for (std::size_t b = a + 1; b < moving.size(); ++b) {
        consider({moving[a], moving[b]}, nearest(scaled(Eigen::all, std::vector{moving[a], moving[b]}), errors, apart));
      }
    }
  }
  if (moving.size() > 2) consider(moving, nearest(scaled(Eigen::all, moving), errors, apart));
  best.p_value = std::min(1.0, best.p_value * tests);
  return best;
}

Eigen::VectorXd between_neighbours(const Eigen::VectorXd& signal, const std::vector<Eigen::Index>& stretches,
                                   const std::vector<double>& weights) {
  Eigen::VectorXd between = signal;
  for (Eigen::Index i = 0; i < signal.size(); ++i) {
    double sum = 0.0;
    double all = 0.0;
    for (Eigen::Index place = 1; place <= std::ssize(weights); ++place) {
      const double weight = weights[static_cast<std::size_t>(place - 1)];
      for (const Eigen::Index k : {i - place, i + place}) {
        if (weight == 0.0 || k < 0 || k >= signal.size() || stretches[k] != stretches[i]) continue;
        sum += weight * signal(k);
        all += weight;
      }
    }
    if (all != 0.0) between(i) = sum / all;
  }
  return between;
}

std::vector<double> weights_of_neighbours(const Recording& recording, double independent_share) {
  const auto places = static_cast<std::size_t>(std::ceil(1.0 / independent_share));
  if (recording.is_filtered()) {
    const Eigen::Vector3d weights = recording.filter().uncorrelated_neighbours();
    if (std::ssize(weights) >= static_cast<Eigen::Index>(places)) return {weights.begin(), weights.end()};
  }
  std::vector<double> at_one_place(places, 0.0);
  at_one_place.back() = 1.0;
  return at_one_place;
}

std::vector<Structure> structure_beside(const TermModel& model, const TermData& data, const Inputs& inputs,
                                        const Eigen::VectorXd& errors, const Missing& missing) {
  constexpr double surprising = 5e-4;
  constexpr double material = 0.05;
  // More than a quarter of what is left: no noise hides what the terms miss, however little of the gap it is.
  constexpr double dominant = 0.25;
  // Signals of a machine always hold a little more than what is asked for.
  constexpr double immaterial = 0.01;
  Eigen::MatrixXd samples = means(inputs.values, data.samples);
  if (!data.stretches.empty()) {
    const std::vector<double> weights = weights_of_neighbours(model.recording(), data.independent_share);
    for (Eigen::Index j = 0; j < errors.size(); ++j) {
      if (!(errors(j) > 0.0)) continue;
      samples.col(j) = between_neighbours(samples.col(j), data.stretches, weights);
    }
  }
  std::vector<Structure> all;
  for (Eigen::Index o = 0; o < data.measured.cols(); ++o) {
    const auto without = [&](const Eigen::MatrixXd& predicted) -> Eigen::VectorXd {
      const Eigen::VectorXd own = data.measured.col(o) - means_of_filtered(predicted.col(o), data.samples);
      return own.cwiseProduct(weights_of(data, o));
    };
    const Eigen::VectorXd left = without(missing.corrected);
    const Eigen::VectorXd gap = without(missing.before);
    const StructureLeft found = structure_left(samples, left, data.stretches, data.independent_share);
    const double common = found.share * left.squaredNorm();
    const double explained = std::max(0.0, gap.squaredNorm() - left.squaredNorm());
    const double p_value = found.p_value * static_cast<double>(data.measured.cols());
    if (p_value > surprising) continue;
    const double share = common / (common + explained);
    if (share < material && found.share < dominant) continue;
    if (!data.stretches.empty() && share < immaterial) continue;
    Structure structure{model.outputs()[o], {}, p_value, share};
    for (const Eigen::Index j : found.columns) structure.inputs.push_back(inputs.names[j]);
    all.push_back(std::move(structure));
  }
  return all;
}

}  // namespace llmt::discovery
