/// \file
/// What a search for missing effects is given, and what it answers.
///
///     for (const llmt::discovery::Finding& finding : verdict.findings) {
///       std::printf("%s%s\n", finding.confirmed ? "" : "perhaps ", finding.family.c_str());
///     }
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt::discovery {

/// What the baseline leaves over, n samples of d components each, stacked sample by sample.
struct Evidence {
  Eigen::VectorXd residuals;    ///< n d: measured - predicted
  Eigen::MatrixXd jacobian;     ///< n d x P: derivatives of the prediction by what the baseline may adjust
  Eigen::Index components = 1;  ///< d
  /// n numbers, or empty: samples of equal number are repeats of one setting, independent draws of the noise.
  std::vector<Eigen::Index> repeats;
  /// Share of the sum of squares that signatures of first order leave even when the explanation is right. No
  /// explanation counts as better than that; else data without noise would call for more and more candidates. 0: exact
  /// signatures.
  double resolution = 0.0;
  /// Share of the samples that count as independent, in (0, 1]: where the noise of samples that follow each other is
  /// alike, n samples say as much as this share of n independent ones.
  double independent_share = 1.0;
  /// n numbers, or empty: samples of equal number keep their signs together in the simulated null of random signs.
  std::vector<Eigen::Index> clusters = {};

  Eigen::Index samples() const { return components > 0 ? residuals.size() / components : 0; }
};

/// One effect at one place: the prediction changes by signature * values to first order.
struct EffectCandidate {
  std::string family;         ///< the cause, e.g. "joint_compliance"; variants of one cause share it
  std::string location;       ///< where, e.g. "joint2"; a family is used at most once at a location
  Eigen::MatrixXd signature;  ///< n d x k
  Eigen::VectorXd lower;      ///< k plausible limits of the values, or empty: none
  Eigen::VectorXd upper;
  bool generic = false;  ///< not a cause but a shape: what it explains is "unknown, looks like this"
  /// Added to the score; 2 ln m for one that was picked as the best of m by looking at the residuals.
  double prior_cost = 0.0;
  /// If explanations predict the same at every sample, the one with the less complex candidate gets the name.
  int complexity = 0;
  /// k, or empty: what signature' residuals lacks because errors of the inputs are in both.
  Eigen::VectorXd moment_correction = {};
};

/// A cause that these samples cannot test.
struct UntestableCause {
  std::string what;  ///< "backlash_approach@joint1", "square a"
  std::string why;   ///< in words
};

struct SearchOptions {
  double false_alarm_rate = 0.003;  ///< of the whole search when nothing is missing
  int null_draws = 300;             ///< of each kind, see search()
  double rival_margin = 6.0;        ///< score difference within which an alternative explains as well
  /// The least complex of the rivals at a place gets the name, though they are not the same at every sample.
  bool simplest_of_rivals = false;
  /// A family is also a rival if the set with it in the place of a finding explains at least 1 - model_error of the
  /// explained sum of squares: masses and lengths are not known to better than that.
  double model_error = 0.008;
  /// Share of the evidence by which causes may be worse than shapes and still be named: a shape that contains a cause
  /// explains always a little more.
  double shape_share = 0.0;
  double materiality = 0.01;  ///< unique share of the explained sum of squares below which a family is left out
  /// As `materiality`, of a single member of a family. 0: members are one cause together.
  double member_materiality = 0.0;
  double tentative_share = 0.1;  ///< share of the explained sum of squares in generic candidates that casts doubt
  double largest_outlier_share = 0.15;
  int largest_set = 16;              ///< candidates at once
  double absorbed_tolerance = 1e-3;  ///< a direction with less of its norm outside the baseline's range is absorbed
  std::uint64_t seed = 1;
};

/// A candidate that is part of an explanation.
struct FindingTerm {
  std::size_t candidate = 0;
  Eigen::VectorXd values;           ///< k; directions that the baseline absorbs are zero
  Eigen::VectorXd standard_errors;  ///< k, at the estimated noise
  double share = 0.0;               ///< of the explained sum of squares that goes with it alone
};

/// Another family that explains the data as well in the place of a finding.
struct Rival {
  std::string family;
  std::vector<std::size_t> candidates;
  double score_difference = 0.0;  ///< of the whole explanation; positive: worse
  bool exact = false;             ///< predicts the same at every sample: these samples cannot distinguish them
};

/// One family of the explanation.
struct Finding {
  std::string family;
  bool generic = false;
  bool confirmed = false;  ///< passed the gate, and nothing material is left that it does not explain
  std::vector<FindingTerm> terms;
  std::vector<Rival> rivals;
  double share = 0.0;       ///< of the explained sum of squares that goes with the family alone
  double score_gain = 0.0;  ///< score lost without it
};

/// What a candidate could have shown.
struct Sensitivity {
  bool absorbed = false;  ///< the baseline can imitate it entirely
  double outside = 0.0;   ///< share of its norm that the baseline cannot imitate
  /// k: smallest value of each parameter, the others zero, that would be found with probability 0.9; infinite if
  /// absorbed.
  Eigen::VectorXd visible;
};

/// The F test of the residual scatter against the scatter of repeats.
struct LackOfFit {
  Eigen::Index dof = 0;       ///< of the repeats; 0: there are none
  double noise = 0.0;         ///< standard deviation of one component from the repeats
  double p_value = 1.0;       ///< of scatter beyond the repeats when the explanation is right
  double excess_share = 0.0;  ///< of the sum of squares beyond noise: the part that the explanation leaves

  /// Whether the repeats are enough to take the noise from them: with 12 degrees of freedom its standard error is 20 %.
  bool has_enough_repeats() const { return dof >= 12; }
};

enum class Answer {
  nothing_missing,
  named,
  indistinguishable,
  unknown,
  failed_held_out,  ///< of find_missing(): with what was found the error on rows set aside is larger
  parameters_only,  ///< of find_missing(): nothing is missing, but parameters are off their nominal values
  inner_state,  ///< of find_missing(): a term that stands for a state which the inputs do not show is among the named
  undecided     ///< of find_missing(): nothing was found, but more is left than the noise that is known; or functions
                ///< that differ elsewhere explain these rows alike
};

/// A cause that would have won, had its values been within their limits.
struct Refused {
  std::size_t candidate = 0;
  Eigen::VectorXd values;
  double score_gain = 0.0;  ///< of the best set with it over the explanation
};

/// Outcome of search().
struct Verdict {
  Answer answer = Answer::nothing_missing;
  std::vector<Finding> findings;      ///< by falling share
  std::vector<std::size_t> outliers;  ///< samples that fit nothing, in the order of falling evidence
  double score_gain = 0.0;            ///< of the explanation over none
  double threshold = 0.0;             ///< that chance alone exceeds at the false alarm rate
  double sum_of_squares = 0.0;        ///< of the residuals, adjusted baseline, no effects, outliers left out
  double left = 0.0;                  ///< with the explanation
  Eigen::Index dof = 0;               ///< of `left`
  double noise = 0.0;                 ///< standard deviation of one component: sqrt(left / dof)
  LackOfFit lack_of_fit;
  std::vector<Sensitivity> sensitivity;  ///< one for each candidate
  Eigen::VectorXd remaining;             ///< n d: residuals that the explanation leaves, zero at outliers
  /// Whether causes were preferred to shapes that explain more, by `shape_share`.
  bool causes_preferred = false;
  std::vector<Refused> refused;  ///< by falling gain, one for each family
};

}  // namespace llmt::discovery
