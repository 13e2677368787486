#include "growth/growth_data.hpp"

#include <cmath>
#include <limits>

#include "base/between.hpp"
#include "base/sum_over.hpp"
#include "numerics/f_distribution.hpp"

namespace llmt {

GrowthData::GrowthData(const GrowthProblem& growth) : problem(growth), training(*growth.training) {
  const Table& table = *training.table;
  for (const int input : growth.options.split_inputs) {
    num_levels.push_back(table.num_levels[input]);
  }
  weights = training.weight_unit * table.weights(training.rows);
  const auto sum = [&](const auto& term) { return sum_of_rows(training.count(), term, growth.max_threads); };
  total_weight = sum([&](Eigen::Index i) { return weights(i); });
  const Eigen::Index count = std::ssize(growth.outputs);
  outputs.resize(training.count(), count);
  output_mean.resize(count);
  output_scale.resize(count);
  output_weights.resize(count);
  rounding.resize(count);
  for (Eigen::Index o = 0; o < count; ++o) {
    outputs.col(o) = table.outputs.col(growth.outputs[o])(training.rows);
    const double magnitude = outputs.col(o).cwiseAbs().maxCoeff();
    output_mean(o) = sum([&](Eigen::Index i) { return weights(i) * outputs(i, o); }) / total_weight;
    outputs.col(o).array() -= output_mean(o);
    const double largest = outputs.col(o).cwiseAbs().maxCoeff();
    output_scale(o) = largest > 0.0 ? std::exp2(std::ilogb(largest)) : 1.0;
    outputs.col(o) /= output_scale(o);
    const double squares = sum([&](Eigen::Index i) { return weights(i) * outputs(i, o) * outputs(i, o); });
    output_weights(o) = squares > 0.0 ? 1.0 / squares : 1.0;
    rounding(o) = 8.0 * std::numeric_limits<double>::epsilon() * magnitude / output_scale(o);
  }
}

double GrowthData::significant_rss(double weight, int rank, double rss, Eigen::Index tested) const {
  const GrowthOptions& options = problem.options;
  const bool has_test = problem.criterion == SplitCriterion::f_test && options.significance < 1.0;
  if (!has_test || tested == 0) return std::numeric_limits<double>::infinity();
  // One more coefficient is the least that two models can have; the more there are, the more they must gain.
  const double added = static_cast<double>(output_weights.size());
  const double freedom = added * (weight - rank) - added;
  if (freedom <= 0.0) return std::numeric_limits<double>::infinity();
  // A little less, so that rounding excludes nothing.
  const double f = 0.999 * f_quantile(options.significance / static_cast<double>(tested), added, freedom);
  return rss / (1.0 + f * added / freedom);
}

bool GrowthData::is_significant(double level, double weight, int rank, double rss, const SplitRanks& split,
                                double split_rss, Eigen::Index tested) const {
  if (level >= 1.0) return true;
  // Several outputs count as that many independent observations of equal variance, which the weights make them at the
  // root.
  const double num_outputs = static_cast<double>(output_weights.size());
  const double added = num_outputs * (split.left + split.right - rank);
  const double freedom = num_outputs * (weight - split.left - split.right);
  if (added <= 0.0 || freedom <= 0.0) return false;
  return chow_p_value(rss - split_rss, added, split_rss / freedom, freedom) * static_cast<double>(tested) < level;
}

double GrowthData::place_threshold(double low, double high, double mean, const Eigen::VectorXd& apart,
                                   const Eigen::VectorXd& slope) const {
  const double curvature = output_weights.dot(slope.cwiseAbs2());
  const Eigen::VectorXd at_low = apart + slope * (low - mean);
  const double meeting = curvature > 0.0 ? low - output_weights.dot(at_low.cwiseProduct(slope)) / curvature : low;
  return meeting > low && meeting < high ? meeting : between(low, high);
}

}  // namespace llmt
