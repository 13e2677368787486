#include "discovery/search/findings.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <map>
#include <set>

#include "discovery/search/replacements.hpp"

namespace llmt::discovery {

Finding finding_of(const Scoring& scoring, const Set& set, const Set& whole, const std::string& family,
                   const SearchOptions& options) {
  const SetFit fit = scoring.fit(set);
  const Set rest = without_family(scoring, set, family);
  Finding finding{
      .family = family, .generic = false, .confirmed = true, .terms = {}, .rivals = {}, .share = 0, .score_gain = 0};
  for (const std::size_t a : set) {
    if (scoring.candidates()[a].family != family) continue;
    finding.generic = scoring.candidates()[a].generic;
    finding.terms.push_back({a, scoring.values(fit, set, a), scoring.standard_errors(fit, set, a),
                             share_of(scoring, set, without(set, a))});
  }
  finding.share = share_of(scoring, set, rest);
  finding.score_gain = scoring.score(rest) - scoring.score(set);
  if (!finding.generic) finding.rivals = rivals_of(scoring, whole, family, options);
  return finding;
}

std::vector<Refused> refused_beyond_limits(const Scoring& scoring, const Set& set, double margin) {
  const std::vector<EffectCandidate>& candidates = scoring.candidates();
  std::vector<bool> limited;
  for (const EffectCandidate& candidate : candidates) {
    limited.push_back(!candidate.generic && candidate.lower.size() != 0);
  }
  const double needed = scoring.score(set) - margin;
  std::vector<Refused> refused;
  for (const Set& base : {Set{}, set}) {
    for (const Scoring::Move& move : scoring.additions(base, limited)) {
      if (move.score >= needed) break;
      const Set grown = with(base, move.candidate);
      const SetFit fit = scoring.fit(grown);
      if (!fit.solvable || scoring.within_limits(fit, grown)) continue;
      refused.push_back({move.candidate, scoring.values(fit, grown, move.candidate), needed + margin - move.score});
    }
    if (set.empty()) break;
  }
  std::ranges::stable_sort(refused, std::greater<>{}, &Refused::score_gain);
  std::set<std::string> families;
  std::erase_if(refused, [&](const Refused& one) { return !families.insert(candidates[one.candidate].family).second; });
  return refused;
}

LackOfFit lack_of_fit(const Scoring& scoring, const SetFit& fit, const std::vector<Eigen::Index>& repeats,
                      const Eigen::VectorXd& remaining) {
  LackOfFit result;
  const Eigen::Index d = scoring.workspace().components();
  std::map<Eigen::Index, std::vector<Eigen::Index>> groups;
  for (std::size_t i = 0; i < repeats.size(); ++i) {
    if (std::ranges::find(scoring.workspace().dropped(), i) == scoring.workspace().dropped().end()) {
      groups[repeats[i]].push_back(i);
    }
  }
  double squares = 0.0;
  for (const auto& [group, members] : groups) {
    if (members.size() < 2) continue;
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(d);
    for (const Eigen::Index i : members) mean += remaining.segment(i * d, d) / static_cast<double>(members.size());
    for (const Eigen::Index i : members) squares += (remaining.segment(i * d, d) - mean).squaredNorm();
    result.dof += d * (std::ssize(members) - 1);
  }
  const double dof = scoring.dof(fit);
  const auto own = static_cast<double>(result.dof);
  if (result.dof < 4 || dof <= own || !(squares > 0.0)) return {};
  const double variance = squares / own;
  result.noise = std::sqrt(variance);
  const double ratio = std::max(0.0, fit.left - squares) / (dof - own) / variance;
  result.p_value = boost::math::cdf(boost::math::complement(boost::math::fisher_f(dof - own, own), ratio));
  const double before =
      scoring.workspace().sum_of_squares() - (dof + static_cast<double>(fit.columns.size())) * variance;
  if (before > 0.0) result.excess_share = std::max(0.0, fit.left - dof * variance) / before;
  return result;
}

std::vector<Sensitivity> sensitivities(const Scoring& scoring, double threshold, double noise) {
  constexpr double power_quantile = 1.2816;  // of the standard normal at 0.9
  std::vector<Sensitivity> all;
  for (std::size_t a = 0; a < scoring.candidates().size(); ++a) {
    const Block& block = scoring.workspace().blocks()[a];
    const Eigen::Index k = scoring.candidates()[a].signature.cols();
    Sensitivity own{block.size == 0, block.outside, Eigen::VectorXd::Constant(k, impossible)};
    if (block.size > 0) {
      const double needed = std::max(0.0, threshold) + scoring.single_cost(a) - scoring.cost({});
      // The gain of an energy E, in units of the noise: n ln(1 + E / (n - k)) - n ln(n / (n - k)).
      const double n = scoring.workspace().degrees();
      const double left = std::max(1.0, n - static_cast<double>(block.size));
      const double least = left * std::expm1(std::max(0.0, needed) / (n * scoring.workspace().independent_share()) +
                                             std::log(std::max(1.0, n / left)));
      const double energy = std::pow(std::sqrt(least) + power_quantile, 2.0);
      // |U' S_i v|: how much a unit of value i alone contributes outside the baseline.
      const Eigen::MatrixXd to_coefficients = block.to_values.completeOrthogonalDecomposition().pseudoInverse();
      for (Eigen::Index i = 0; i < k; ++i) {
        const double seen = to_coefficients.col(i).norm();
        if (seen > 0.0) own.visible(i) = std::sqrt(energy) * noise / seen;
      }
    }
    all.push_back(std::move(own));
  }
  return all;
}

}  // namespace llmt::discovery
