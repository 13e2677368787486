#include "numerics/two_samples.hpp"

#include <algorithm>
#include <boost/math/distributions/hypergeometric.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numeric>

#include "llmt/random.hpp"

namespace llmt {
namespace {

double chi_square_survival(double statistic, double freedom) {
  return boost::math::gamma_q(0.5 * freedom, 0.5 * std::max(statistic, 0.0));
}

// Sums over one sample, or over both, of the rank, its distance from the middle, and their products.
struct RankSums {
  double rows = 0.0;
  double rank = 0.0;
  double distance = 0.0;
  double rank_squared = 0.0;
  double distance_squared = 0.0;
  double product = 0.0;

  // `rank`: less the middle one, so that sums of many rows keep their digits.
  void add(double count, double centred) {
    const double from_middle = std::abs(centred);
    rows += count;
    rank += count * centred;
    distance += count * from_middle;
    rank_squared += count * centred * centred;
    distance_squared += count * from_middle * from_middle;
    product += count * centred * from_middle;
  }
};

// A category in both samples.
struct Shares {
  double one = 0.0;
  double other = 0.0;
};

// The categories, ascending, with the rarest joined until `fewest` rows of each are expected in either sample.
std::vector<Shares> joined(std::vector<Shares> all, double smaller_share, double fewest) {
  std::ranges::sort(all, {}, [](const Shares& shares) { return shares.one + shares.other; });
  std::vector<Shares> result;
  Shares rare;
  for (const Shares& shares : all) {
    rare.one += shares.one;
    rare.other += shares.other;
    if ((rare.one + rare.other) * smaller_share < fewest) continue;
    result.push_back(rare);
    rare = {};
  }
  if (!result.empty()) {
    result.back().one += rare.one;
    result.back().other += rare.other;
  }
  return result;
}

}  // namespace

double same_numbers_probability(const CountedSample& one, std::vector<double> other) {
  std::ranges::sort(other);
  const auto m = static_cast<double>(std::accumulate(one.counts.begin(), one.counts.end(), Eigen::Index{0}));
  const auto n = static_cast<double>(other.size());
  if (m == 0.0 || n == 0.0) return 1.0;
  RankSums of_other;
  RankSums of_all;
  double below = 0.0;
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < one.values.size() || j < other.size()) {
    const double value =
        j == other.size() || (i < one.values.size() && one.values[i] <= other[j]) ? one.values[i] : other[j];
    double in_one = 0.0;
    double in_other = 0.0;
    for (; i < one.values.size() && one.values[i] == value; ++i) in_one += static_cast<double>(one.counts[i]);
    for (; j < other.size() && other[j] == value; ++j) in_other += 1.0;
    const double centred = below + 0.5 * (in_one + in_other) - 0.5 * (m + n);
    of_other.add(in_other, centred);
    of_all.add(in_one + in_other, centred);
    below += in_one + in_other;
  }
  const double all = m + n;
  const double scale = (1.0 / n + 1.0 / m) / (all - 1.0);  // of sums of squares
  const double rank_variance = scale * (of_all.rank_squared - of_all.rank * of_all.rank / all);
  const double distance_variance = scale * (of_all.distance_squared - of_all.distance * of_all.distance / all);
  const double covariance = scale * (of_all.product - of_all.rank * of_all.distance / all);
  if (!(rank_variance > 0.0)) return 1.0;
  const double rank = of_other.rank / n - (of_all.rank - of_other.rank) / m;
  const double distance = of_other.distance / n - (of_all.distance - of_other.distance) / m;
  const double determinant = rank_variance * distance_variance - covariance * covariance;
  if (!(determinant > 1e-9 * rank_variance * rank_variance)) {
    return chi_square_survival(rank * rank / rank_variance, 1.0);
  }
  const double statistic =
      (distance_variance * rank * rank - 2.0 * covariance * rank * distance + rank_variance * distance * distance) /
      determinant;
  return chi_square_survival(statistic, 2.0);
}

double same_shares_probability(const std::vector<Eigen::Index>& one, const std::vector<Eigen::Index>& other) {
  constexpr double fewest = 5.0;
  std::vector<Shares> all;
  double m = 0.0;
  double n = 0.0;
  for (std::size_t k = 0; k < one.size(); ++k) {
    all.push_back({static_cast<double>(one[k]), static_cast<double>(other[k])});
    m += all.back().one;
    n += all.back().other;
  }
  if (m == 0.0 || n == 0.0) return 1.0;
  all = joined(std::move(all), std::min(m, n) / (m + n), fewest);
  if (all.size() < 2) return 1.0;
  double statistic = 0.0;
  for (const auto& [in_one, in_other] : all) {
    const double both = in_one + in_other;
    const double difference = in_one * n - in_other * m;
    statistic += difference * difference / (both * n * m);
  }
  return chi_square_survival(statistic, static_cast<double>(all.size() - 1));
}

double same_share_probability(Eigen::Index found_in_one, Eigen::Index one, Eigen::Index found_in_other,
                              Eigen::Index other) {
  const Eigen::Index found = found_in_one + found_in_other;
  if (found == 0 || found == one + other || one == 0 || other == 0) return 1.0;
  const boost::math::hypergeometric_distribution<double> count(
      static_cast<unsigned>(found), static_cast<unsigned>(other), static_cast<unsigned>(one + other));
  const Eigen::Index least = std::max(Eigen::Index{0}, found - one);
  const double at_most = cdf(count, static_cast<double>(found_in_other));
  const double at_least =
      found_in_other == least ? 1.0 : cdf(complement(count, static_cast<double>(found_in_other - 1)));
  return std::min(1.0, 2.0 * std::min(at_most, at_least));
}

double beyond_largest_probability(Eigen::Index count, Eigen::Index fresh, Eigen::Index known) {
  double probability = 1.0;
  for (Eigen::Index k = 0; k < count && probability > 0.0; ++k) {
    probability *= static_cast<double>(fresh - k) / static_cast<double>(fresh + known - k);
  }
  return probability;
}

double outside_probability(Eigen::Index outside, Eigen::Index fresh, Eigen::Index rank, Eigen::Index known) {
  const auto n = static_cast<double>(fresh);
  const auto a = static_cast<double>(rank);
  const auto b = static_cast<double>(known + 1 - rank);
  const auto log_beta = [](double p, double q) { return std::lgamma(p) + std::lgamma(q) - std::lgamma(p + q); };
  double probability = 0.0;
  for (Eigen::Index count = outside; count <= fresh; ++count) {
    const auto k = static_cast<double>(count);
    probability += std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) +
                            log_beta(k + a, n - k + b) - log_beta(a, b));
  }
  return std::min(1.0, probability);
}

double larger_mean_probability(const std::vector<double>& one, const std::vector<double>& other) {
  constexpr int permutations = 4999;
  constexpr std::size_t most_permuted = 20000;
  if (one.empty() || other.empty()) return 1.0;
  std::vector<double> all = one;
  all.insert(all.end(), other.begin(), other.end());
  const double total = std::accumulate(all.begin(), all.end(), 0.0);
  const auto count = static_cast<double>(all.size());
  const double observed = std::accumulate(other.begin(), other.end(), 0.0);
  const std::size_t drawn = std::min(one.size(), other.size());
  if (drawn > most_permuted) {
    const auto n = static_cast<double>(other.size());
    double squares = 0.0;
    for (const double value : all) squares += (value - total / count) * (value - total / count);
    const double variance = squares / (count - 1.0) * n * (count - n) / count;
    if (!(variance > 0.0)) return 1.0;
    return 0.5 * std::erfc((observed - total * n / count) / std::sqrt(2.0 * variance));
  }
  const bool draws_other = drawn == other.size();
  Random random(1);
  int at_least = 1;
  for (int permutation = 0; permutation < permutations; ++permutation) {
    double sum = 0.0;
    for (std::size_t k = 0; k < drawn; ++k) {
      std::swap(all[k], all[k + random.below(all.size() - k)]);
      sum += all[k];
    }
    const double of_other = draws_other ? sum : total - sum;
    at_least += of_other >= observed * (1.0 - 1e-12) ? 1 : 0;
  }
  return static_cast<double>(at_least) / static_cast<double>(permutations + 1);
}

std::vector<double> holm(const std::vector<double>& probabilities) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < probabilities.size(); ++k) {
    if (!std::isnan(probabilities[k])) order.push_back(k);
  }
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return probabilities[k]; });
  std::vector<double> adjusted = probabilities;
  double largest = 0.0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    largest = std::max(largest, static_cast<double>(order.size() - rank) * probabilities[order[rank]]);
    adjusted[order[rank]] = std::min(1.0, largest);
  }
  return adjusted;
}

}  // namespace llmt
