#include "distributed/top_split.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "growth/search/adjusted_rss.hpp"
#include "stream/sums.hpp"

namespace llmt::distributed {
namespace {

// A child has at least this part of the weight wherever there is such a split, so that few passes reach branches.
constexpr double smallest_part = 8.0;

// The bins of an input in the order in which they are cut into two sides.
struct Bins {
  Eigen::Index input = 0;
  std::vector<const double*> grams;
  std::vector<Eigen::Index> rows;
  std::vector<Eigen::Index> levels;  // of a category: which level a bin is

  std::size_t size() const { return grams.size(); }
  double weight(std::size_t bin) const { return grams[bin][0]; }
};

// The mean residual of a bin's rows by the node's model.
double mean_residual(const GramShape& shape, const double* gram, const Eigen::VectorXd& change) {
  const Eigen::Index residual = shape.coefficients();
  double sum = gram[shape.at(residual, 0)];
  for (Eigen::Index k = 0; k < change.size(); ++k) sum -= change(k) * gram[shape.at(k, 0)];
  return sum / gram[0];
}

std::vector<Bins> bins_of_inputs(const StateData& data, const NodeSums& sums, const Eigen::VectorXd& change) {
  const GramShape shape = data.shape();
  const std::vector<Eigen::Index> first = first_bins(data);
  std::vector<Bins> all;
  for (Eigen::Index j = 0; j < data.inputs(); ++j) {
    Bins bins;
    bins.input = j;
    const auto gram = [&](Eigen::Index bin) { return sums.grams.data() + (first[j] + bin) * shape.size(); };
    std::vector<Eigen::Index> order(bins_of(data, j));
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    if (data.is_category(j)) {
      std::erase_if(order, [&](Eigen::Index level) { return sums.counts[first[j] + level] == 0; });
      std::ranges::stable_sort(order, {},
                               [&](Eigen::Index level) { return mean_residual(shape, gram(level), change); });
      bins.levels = order;
    }
    for (const Eigen::Index bin : order) {
      bins.grams.push_back(gram(bin));
      bins.rows.push_back(sums.counts[first[j] + bin]);
    }
    if (bins.size() > 1) all.push_back(std::move(bins));
  }
  return all;
}

// The weight of the smaller child of the most even split.
double most_even(const std::vector<Bins>& inputs, double weight) {
  double most = 0.0;
  for (const Bins& bins : inputs) {
    double before = 0.0;
    for (std::size_t bin = 0; bin + 1 < bins.size(); ++bin) {
      before += bins.weight(bin);
      most = std::max(most, std::min(before, weight - before));
    }
  }
  return most;
}

// The rows on one side, of which ranks are counted.
Eigen::Index whole(double weight) { return static_cast<Eigen::Index>(std::floor(weight)); }

}  // namespace

TopSplit best_split(const StateData& data, const NodeSums& sums, const TopNode& node, const Eigen::VectorXd& change,
                    int rank) {
  const GramShape shape = data.shape();
  const double weight = node.gram[0];
  const AdjustedRss scale(weight, rank, remaining(shape, node.gram.data(), change));
  const std::vector<Bins> inputs = bins_of_inputs(data, sums, change);
  const double least = std::min(std::floor(weight / smallest_part), most_even(inputs, weight));
  ResidualSums models(shape, Eigen::VectorXd::Ones(1));
  SidesOfCuts sides;
  TopSplit best;
  if (least < static_cast<double>(scale.enough_rows())) return best;
  for (const Bins& bins : inputs) {
    sides.sum(shape, bins.grams);
    sides.evaluate(models);
    Eigen::Index rows = 0;
    double before = 0.0;
    for (std::size_t cut = 0; cut + 1 < bins.size(); ++cut) {
      rows += bins.rows[cut];
      before += bins.weight(cut);
      if (std::min(before, weight - before) < least) continue;
      const int ranks = scale.counted(sides.rank_left[cut], whole(before)) +
                        scale.counted(sides.rank_right[cut], whole(weight - before));
      const double adjusted = scale.of(sides.rss_left[cut] + sides.rss_right[cut], ranks);
      if (adjusted >= best.adjusted) continue;
      best = {bins.input, adjusted, static_cast<Eigen::Index>(cut), {}, rows, before};
      if (bins.levels.empty()) continue;
      best.level_side.assign(bins_of(data, bins.input), 0);
      for (std::size_t bin = 0; bin < bins.size(); ++bin) best.level_side[bins.levels[bin]] = bin <= cut ? -1 : 1;
    }
  }
  return best;
}

}  // namespace llmt::distributed
