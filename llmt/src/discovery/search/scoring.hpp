// Scores of sets of candidates.
#pragma once

#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "discovery/search/workspace.hpp"

namespace llmt::discovery {

using Set = std::vector<std::size_t>;  // candidates, ascending

inline constexpr double impossible = std::numeric_limits<double>::infinity();

/// Least squares of the residuals on a set.
struct SetFit {
  bool solvable = false;  ///< no direction of it is a combination of the others
  Eigen::VectorXd coefficients;
  std::vector<Eigen::Index> columns;
  Eigen::MatrixXd factor;  ///< lower Cholesky factor of the Gram matrix of `columns`
  double left = 0.0;       ///< residual sum of squares
};

class Scoring {
 public:
  Scoring(const Workspace& workspace, const std::vector<EffectCandidate>& candidates);

  const Workspace& workspace() const { return *workspace_; }
  const std::vector<EffectCandidate>& candidates() const { return *candidates_; }

  SetFit fit(const Set& set) const;

  /// As in search(), dropped samples with their costs included; impossible if the set has dependent directions, uses a
  /// family twice at a location, or has values beyond their limits.
  double score(const Set& set) const;

  /// True if the values are within their limits, up to two standard errors.
  bool within_limits(const SetFit& fit, const Set& set) const;

  /// The part of the score that does not depend on how much the set explains.
  double cost(const Set& set) const;
  double outlier_cost() const;
  /// s N ln(left / (N - k)), s the independent share, of an explanation with k directions; impossible where k leaves
  /// too little freedom to judge.
  double misfit(double left, Eigen::Index directions) const;

  bool usable(std::size_t candidate) const { return workspace_->blocks()[candidate].size > 0; }

  /// A candidate to add and the score with it; limits of values are not checked.
  struct Move {
    std::size_t candidate;
    double score;
  };
  /// Scores of `set` with each of the allowed candidates added, ascending; sets with dependent directions left out.
  std::vector<Move> additions(const Set& set, const std::vector<bool>& allowed) const;

  Eigen::VectorXd values(const SetFit& fit, const Set& set, std::size_t candidate) const;
  Eigen::VectorXd standard_errors(const SetFit& fit, const Set& set, std::size_t candidate) const;
  double dof(const SetFit& fit) const;

  /// Residuals that the set leaves.
  Eigen::VectorXd remaining(const SetFit& fit) const;
  /// For each sample i: (I - H_ii)^-1 e_i of the set with the baseline, and what dropping it removes from the sum of
  /// squares. Dropped samples have zeros.
  struct Deletion {
    Eigen::VectorXd errors;  ///< n d
    Eigen::VectorXd gains;   ///< n
  };
  Deletion deletion(const SetFit& fit) const;

  double single_cost(std::size_t candidate) const { return single_costs_[candidate]; }

 private:
  const Workspace* workspace_;
  const std::vector<EffectCandidate>* candidates_;
  std::vector<std::size_t> family_;     // number of the family of every candidate
  std::vector<double> family_choices_;  // n_loc
  std::vector<double> single_costs_;
  double families_ = 0.0;
  double log_degrees_ = 0.0;

  double family_cost(std::size_t family, double used) const;
};

bool contains(const Set& set, std::size_t candidate);
Set with(Set set, std::size_t candidate);
Set without(Set set, std::size_t candidate);
Set filtered(const Set& set, const std::function<bool(std::size_t)>& keep);

std::set<std::string> families_of(const Scoring& scoring, const Set& set);

Set without_family(const Scoring& scoring, const Set& set, const std::string& family);

/// Share of the sum of squares explained by `set` that is lost where only `rest`, a subset of it, explains.
double share_of(const Scoring& scoring, const Set& set, const Set& rest);

}  // namespace llmt::discovery
