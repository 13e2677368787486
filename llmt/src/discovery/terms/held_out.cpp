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

TermFit fit_without(const TermModel& model, const TermData& kept, const TermFit& fit, std::size_t term) {
  std::vector<PlacedTerm> rest = fit.placed;
  rest.erase(rest.begin() + static_cast<Eigen::Index>(term));
  return fit_terms(model, kept, fit.parameters, rest);
}

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

void judge_held_out(const TermModel& model, const TermData& kept, const TermData& held_out, const TermFit& baseline,
                    const Settled& settled, Missing& missing) {
  if (held_out.samples.size() == 0 || settled.fit.placed.empty()) return;
  const Eigen::VectorXd before = squared_errors(model, held_out, baseline);
  const Eigen::VectorXd after = squared_errors(model, held_out, settled.fit);
  if (after.sum() > before.sum()) missing.failing_rows = rows_of_growth(held_out.samples, after - before);
  const Eigen::MatrixXd simulated = model.simulated(settled.fit.parameters);
  for (std::size_t t = 0; t < settled.fit.placed.size(); ++t) {
    const PlacedTerm& placed = settled.fit.placed[t];
    // What a term changes there, in units of the noise, is by how much the sum of squares should shrink; its standard
    // deviation is twice the root of that. Samples that a term hardly reaches cannot judge it.
    constexpr double judged = 4.0;
    const double change = (stacked_signature(model, held_out, placed, simulated) * placed.coefficients).squaredNorm();
    if (change < judged * std::pow(settled.verdict.noise, 2.0)) continue;
    const double without = squared_errors(model, held_out, fit_without(model, kept, settled.fit, t)).sum();
    for (FoundTerm& found : missing.found) {
      const bool is_this = found.term == placed.term && found.output_index == placed.output &&
                           found.constants.size() == placed.constants.size() && found.constants == placed.constants;
      if (is_this) found.shrinks_gap = after.sum() < without;
    }
  }
}

}  // namespace llmt::discovery
