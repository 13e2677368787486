#include "boosted/binned_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace llmt {
namespace {

struct Distinct {
  double value = 0.0;
  double weight = 0.0;
};

std::vector<Distinct> distinct_values(const Eigen::VectorXd& values, const Eigen::VectorXd& weights) {
  std::vector<Eigen::Index> order;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (!std::isnan(values(i)) && weights(i) > 0.0) order.push_back(i);
  }
  std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return values(i); });
  std::vector<Distinct> result;
  for (const Eigen::Index i : order) {
    if (result.empty() || result.back().value < values(i)) result.push_back({values(i), 0.0});
    result.back().weight += weights(i);
  }
  return result;
}

double halfway(double low, double high) {
  const double middle = low + (high - low) / 2.0;
  return middle < high ? middle : low;
}

// A value that is heavier than a bin has one of its own; the others share the bins that are left.
std::vector<double> edges_of(const std::vector<Distinct>& values) {
  std::vector<double> edges;
  double left = 0.0;
  for (const Distinct& one : values) left += one.weight;
  int bins_left = most_bins;
  double in_bin = 0.0;
  for (std::size_t k = 0; k + 1 < values.size(); ++k) {
    in_bin += values[k].weight;
    const double size = left / bins_left;
    const bool all_fit = values.size() <= static_cast<std::size_t>(most_bins);
    if (!all_fit && in_bin + values[k + 1].weight / 2.0 < size) continue;
    if (std::ssize(edges) + 1 == most_bins) break;
    edges.push_back(halfway(values[k].value, values[k + 1].value));
    left -= in_bin;
    in_bin = 0.0;
    --bins_left;
  }
  return edges;
}

}  // namespace

BinnedFeature bin_feature(BoostedFeature feature, const Eigen::VectorXd& values, const Eigen::VectorXd& weights) {
  BinnedFeature result;
  result.feature = feature;
  const std::vector<Distinct> distinct = distinct_values(values, weights);
  if (!distinct.empty()) {
    result.low = distinct.front().value;
    result.high = distinct.back().value;
  }
  result.edges = edges_of(distinct);
  const std::size_t bins = result.edges.size() + 1;
  std::vector<double> sums(bins, 0.0);
  std::vector<double> of_bin(bins, 0.0);
  std::size_t bin = 0;
  for (const Distinct& one : distinct) {
    while (bin < result.edges.size() && one.value > result.edges[bin]) ++bin;
    sums[bin] += one.weight * one.value;
    of_bin[bin] += one.weight;
  }
  for (std::size_t b = 0; b < bins; ++b) result.centres.push_back(of_bin[b] > 0.0 ? sums[b] / of_bin[b] : 0.0);
  result.codes.resize(values.size());
  result.values.resize(values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (std::isnan(values(i))) {
      result.codes[i] = missing_code;
      result.values[i] = 0.0F;
      result.has_missing = true;
      continue;
    }
    result.codes[i] =
        static_cast<std::uint8_t>(std::ranges::lower_bound(result.edges, values(i)) - result.edges.begin());
    result.values[i] = static_cast<float>(values(i));
  }
  return result;
}

}  // namespace llmt
