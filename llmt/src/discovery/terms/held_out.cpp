#include "discovery/terms/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace llmt::discovery {
namespace {

// Squared errors of the samples.
Eigen::VectorXd squared_errors(const TermModel& model, const TermData& data, const TermFit& fit) {
  const Eigen::VectorXd errors = scaled_residuals(model, data, fit.parameters, fit.placed);
  const Eigen::Index d = data.measured.cols();
  return errors.reshaped(d, data.samples.size()).colwise().squaredNorm();
}

// Samples that are far off with the terms and without them say nothing of either. Where they are many, the noise is no
// measure of what is left.
TermData without_outliers(const TermData& data, const Eigen::VectorXd& before, const Eigen::VectorXd& after,
                          double noise) {
  constexpr double far = 5.0;
  constexpr double largest_share = 0.15;
  const double limit = far * far * noise * static_cast<double>(data.measured.cols());
  std::vector<std::size_t> outliers;
  for (Eigen::Index i = 0; i < before.size(); ++i) {
    if (std::min(before(i), after(i)) > limit) outliers.push_back(static_cast<std::size_t>(i));
  }
  return static_cast<double>(outliers.size()) > largest_share * static_cast<double>(before.size())
             ? data
             : without_samples(data, outliers);
}

TermFit fit_without(const TermModel& model, const TermData& kept, const TermFit& fit, std::size_t term) {
  std::vector<PlacedTerm> rest = fit.placed;
  rest.erase(rest.begin() + static_cast<Eigen::Index>(term));
  return fit_terms(model, kept, fit.parameters, rest);
}

// Terms that change samples by C, a sum of squares in units of the variance of the noise, should shrink the sum of
// squares there by C, with a standard deviation of 2 sqrt(C). Where only a share of the samples is independent, both
// sums are of that share.
struct Judgement {
  double change = 0.0;
  double shrunk = 0.0;

  // Samples that terms hardly reach cannot judge them.
  bool is_possible() const { return change > 4.0; }
  bool shrinks() const { return shrunk > 0.0; }
  bool refutes() const { return !shrinks() && shrunk < change - 6.0 * std::sqrt(change); }
};

// Rows of the samples that make up most of the growth of the error.
std::vector<Eigen::Index> rows_of_growth(const Samples& samples, const Eigen::VectorXd& growth) {
  constexpr std::size_t most = 10;
  constexpr double large = 0.1;  // of all that grew
  std::vector<Eigen::Index> order(growth.size());
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::ranges::stable_sort(order, std::greater<>{}, [&](Eigen::Index i) { return growth(i); });
  const double all = growth.cwiseMax(0.0).sum();
  std::vector<Eigen::Index> rows;
  for (const Eigen::Index i : order) {
    if (!rows.empty() && (growth(i) < large * all || rows.size() >= most)) break;
    for (const Eigen::Index row : samples.rows_of(i)) rows.push_back(row);
  }
  return rows;
}

}  // namespace

void judge_held_out(const TermModel& model, const TermData& kept, const TermData& aside, const TermFit& baseline,
                    const Settled& settled, Missing& missing) {
  if (aside.samples.size() == 0 || settled.fit.placed.empty()) return;
  const double variance = std::pow(settled.verdict.noise, 2.0);
  const double noise = variance / kept.independent_share;
  const TermData held_out = without_outliers(aside, squared_errors(model, aside, baseline),
                                             squared_errors(model, aside, settled.fit), variance);
  const Eigen::VectorXd before = squared_errors(model, held_out, baseline);
  const Eigen::VectorXd after = squared_errors(model, held_out, settled.fit);
  const Eigen::VectorXd change = scaled_residuals(model, held_out, baseline.parameters, baseline.placed) -
                                 scaled_residuals(model, held_out, settled.fit.parameters, settled.fit.placed);
  const Judgement all{change.squaredNorm() / noise, (before.sum() - after.sum()) / noise};
  if (all.is_possible() && !all.shrinks()) missing.failing_rows = rows_of_growth(held_out.samples, after - before);
  const Eigen::MatrixXd simulated = model.simulated(settled.fit.parameters);
  for (std::size_t t = 0; t < settled.fit.placed.size(); ++t) {
    const PlacedTerm& placed = settled.fit.placed[t];
    const Eigen::VectorXd own = stacked_signature(model, held_out, placed, simulated) * placed.coefficients;
    Judgement judgement{own.squaredNorm() / noise, 0.0};
    if (!judgement.is_possible()) continue;
    const double without = squared_errors(model, held_out, fit_without(model, kept, settled.fit, t)).sum();
    judgement.shrunk = (without - after.sum()) / noise;
    for (FoundTerm& found : missing.found) {
      const bool is_this = found.term == placed.term && found.output_index == placed.output &&
                           found.constants.size() == placed.constants.size() && found.constants == placed.constants;
      if (!is_this) continue;
      found.shrinks_gap = judgement.shrinks();
      found.is_refuted = judgement.refutes();
    }
  }
}

}  // namespace llmt::discovery
