#include "llmt/discovery/search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "discovery/search/explore.hpp"
#include "discovery/search/findings.hpp"
#include "discovery/search/null_gate.hpp"
#include "discovery/search/replacements.hpp"

namespace llmt::discovery {
namespace {

[[noreturn]] void refuse(const std::string& message) {
  throw std::invalid_argument("llmt::discovery::search: " + message);
}

void check(const Evidence& evidence, const std::vector<EffectCandidate>& candidates, const SearchOptions& options) {
  const Eigen::Index rows = evidence.residuals.size();
  if (evidence.components < 1) refuse(fmt::format("components is {}, must be at least 1", evidence.components));
  if (rows == 0 || rows % evidence.components != 0) {
    refuse(fmt::format("residuals has {} entries, must be a multiple of {} and not 0", rows, evidence.components));
  }
  if (evidence.jacobian.rows() != rows && evidence.jacobian.cols() > 0) {
    refuse(fmt::format("jacobian has {} rows, must be {}", evidence.jacobian.rows(), rows));
  }
  if (!evidence.repeats.empty() && std::ssize(evidence.repeats) != evidence.samples()) {
    refuse(fmt::format("repeats has {} entries, must be {}", evidence.repeats.size(), evidence.samples()));
  }
  if (!(evidence.resolution >= 0.0 && evidence.resolution < 1.0)) {
    refuse(fmt::format("resolution is {}, must be in [0, 1)", evidence.resolution));
  }
  if (!(evidence.independent_share > 0.0 && evidence.independent_share <= 1.0)) {
    refuse(fmt::format("independent_share is {}, must be in (0, 1]", evidence.independent_share));
  }
  if (!evidence.clusters.empty() && std::ssize(evidence.clusters) != evidence.samples()) {
    refuse(fmt::format("clusters has {} entries, must be {}", evidence.clusters.size(), evidence.samples()));
  }
  if (!evidence.residuals.allFinite()) refuse("a residual is not finite");
  if (!evidence.jacobian.allFinite()) refuse("an entry of the jacobian is not finite");
  if (!(options.false_alarm_rate > 0.0 && options.false_alarm_rate < 0.1)) {
    refuse(fmt::format("false_alarm_rate is {}, must be in (0, 0.1)", options.false_alarm_rate));
  }
  if (options.null_draws < 50) refuse(fmt::format("null_draws is {}, must be at least 50", options.null_draws));
  for (const EffectCandidate& candidate : candidates) {
    const std::string name = fmt::format("candidate {}@{}", candidate.family, candidate.location);
    const Eigen::Index k = candidate.signature.cols();
    if (candidate.signature.rows() != rows || k == 0) {
      refuse(fmt::format("signature of {} is {} x {}, must have {} rows and a column", name, candidate.signature.rows(),
                         k, rows));
    }
    if (!candidate.signature.allFinite()) refuse("signature of " + name + " is not finite");
    if (candidate.lower.size() != candidate.upper.size() ||
        (candidate.lower.size() != 0 && candidate.lower.size() != k)) {
      refuse("limits of " + name + " must be empty or as many as its signature has columns");
    }
    if (candidate.moment_correction.size() != 0 &&
        (candidate.moment_correction.size() != k || !candidate.moment_correction.allFinite())) {
      refuse(fmt::format("moment_correction of {} must be empty or {} finite numbers", name, k));
    }
    if (!std::isfinite(candidate.prior_cost)) refuse("prior_cost of " + name + " is not finite");
  }
}

// Names of causes, shapes where causes do not do (step 5).
Explained choose(const Scoring& scoring, const Set& start, const SearchOptions& options, bool& causes_preferred) {
  causes_preferred = false;
  const std::vector<EffectCandidate>& candidates = scoring.candidates();
  const std::vector<bool> all(candidates.size(), true);
  std::vector<bool> causes;
  std::vector<bool> shapes;
  for (const EffectCandidate& candidate : candidates) {
    causes.push_back(!candidate.generic);
    shapes.push_back(candidate.generic);
  }
  const Explained mixed = best_set(scoring, all, start, options.largest_set);
  if (std::ranges::none_of(mixed.set, [&](std::size_t a) { return candidates[a].generic; })) return mixed;
  const Explained named = best_set(scoring, causes, mixed.set, options.largest_set);
  const double evidence = scoring.score({}) - mixed.score;
  if (named.score <= mixed.score + options.shape_share * evidence) {
    causes_preferred = named.score > mixed.score;
    return named;
  }
  const Explained shaped = best_set(scoring, shapes, mixed.set, options.largest_set);
  if (shaped.score <= mixed.score + options.rival_margin) return shaped;
  return mixed;
}

// Step 6.
Set prune(const Scoring& scoring, Set set, const SearchOptions& options) {
  const auto press = [&](const Set& s) { return scoring.deletion(scoring.fit(s)).errors.squaredNorm(); };
  while (!set.empty()) {
    const double error = press(set);
    double smallest = impossible;
    Set best;
    const auto consider = [&](const Set& rest, double materiality) {
      const double share = share_of(scoring, set, rest);
      const bool useless = press(rest) <= error;
      // A family that only helps together with others has a small share of its own, but none of them may go alone.
      if ((useless || share < materiality) && share < smallest) {
        smallest = share;
        best = rest;
      }
    };
    for (const std::string& family : families_of(scoring, set)) {
      consider(without_family(scoring, set, family), options.materiality);
    }
    for (const std::size_t member : set) {
      if (options.member_materiality > 0.0) consider(without(set, member), options.member_materiality);
    }
    if (smallest == impossible) break;
    set = best;
  }
  return set;
}

Answer answer_of(const std::vector<Finding>& findings, bool shapes_are_material) {
  if (findings.empty()) return Answer::nothing_missing;
  if (shapes_are_material) return Answer::unknown;
  const bool has_rivals = std::ranges::any_of(findings, [](const Finding& finding) { return !finding.rivals.empty(); });
  return has_rivals ? Answer::indistinguishable : Answer::named;
}

}  // namespace

Verdict search(const Evidence& evidence, const std::vector<EffectCandidate>& candidates, const SearchOptions& options) {
  check(evidence, candidates, options);
  const Workspace full(evidence, candidates, options.absorbed_tolerance);
  const auto largest = static_cast<std::size_t>(options.largest_outlier_share * static_cast<double>(full.samples()));
  Workspace workspace = full;
  workspace.drop(competing_outliers(full, candidates, options.largest_set, largest));
  Verdict verdict;
  Explained found = choose(Scoring(workspace, candidates), {}, options, verdict.causes_preferred);
  // The outliers depend on the explanation, and the explanation on the outliers.
  for (int round = 0; round < 3; ++round) {
    std::vector<std::size_t> outliers = outliers_given(full, candidates, found.set, largest);
    if (std::set(outliers.begin(), outliers.end()) ==
        std::set(workspace.dropped().begin(), workspace.dropped().end())) {
      break;
    }
    workspace = full;
    workspace.drop(outliers);
    found = choose(Scoring(workspace, candidates), found.set, options, verdict.causes_preferred);
  }
  const Scoring scoring(workspace, candidates);
  verdict.outliers = workspace.dropped();
  found.set = least_complex(scoring, found.set, options);
  // Evidence that would not decide between two rivals is none.
  verdict.threshold = std::max(options.rival_margin, chance_gain(scoring, options));
  verdict.score_gain = scoring.score({}) - scoring.score(found.set);
  Set set = verdict.score_gain > verdict.threshold ? prune(scoring, found.set, options) : Set{};
  const auto generic = [&](std::size_t a) { return candidates[a].generic; };
  const Set causes = filtered(set, [&](std::size_t a) { return !generic(a); });
  const bool shapes_are_material =
      causes.size() < set.size() && share_of(scoring, set, causes) > options.tentative_share;
  if (!shapes_are_material) set = causes;
  const SetFit fit = scoring.fit(set);
  verdict.sum_of_squares = workspace.sum_of_squares();
  verdict.left = fit.left;
  verdict.dof = static_cast<Eigen::Index>(scoring.dof(fit));
  verdict.noise = std::sqrt(fit.left / scoring.dof(fit));
  verdict.remaining = scoring.remaining(fit);
  for (const std::size_t sample : verdict.outliers) {
    const Eigen::Index d = workspace.components();
    verdict.remaining.segment(sample * d, d).setZero();
  }
  verdict.lack_of_fit = lack_of_fit(scoring, fit, evidence.repeats, verdict.remaining);
  verdict.sensitivity = sensitivities(scoring, verdict.threshold, verdict.noise);
  for (const std::string& family : families_of(scoring, set)) {
    verdict.findings.push_back(finding_of(scoring, set, found.set, family, options));
    verdict.findings.back().confirmed = !shapes_are_material && !verdict.findings.back().generic;
  }
  std::ranges::stable_sort(verdict.findings, std::greater<>{}, &Finding::share);
  verdict.refused = refused_beyond_limits(scoring, set, verdict.threshold);
  verdict.answer = answer_of(verdict.findings, shapes_are_material);
  return verdict;
}

std::string to_string(Answer answer) {
  switch (answer) {
    case Answer::nothing_missing:
      return "nothing missing";
    case Answer::named:
      return "named";
    case Answer::indistinguishable:
      return "named, indistinguishable";
    case Answer::unknown:
      return "unknown effect";
    case Answer::failed_held_out:
      return "failed on held-out rows";
    case Answer::parameters_only:
      return "parameters only";
    case Answer::inner_state:
      return "an inner state";
    case Answer::undecided:
      return "undecided";
  }
  return "";
}

}  // namespace llmt::discovery
