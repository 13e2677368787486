// Answers among other terms, their errors on stretches that no fit has used, and which of two answers stands.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "discovery/answer/one_search.hpp"
#include "discovery/answer/term_fit.hpp"

namespace llmt::discovery {

/// K-fold cross-validation of answers, whose terms stand, on all samples but those apart: in turn, two of
/// ten stretches are left out, numbers of terms and parameters are fitted to the others, and the two are predicted
/// (Stone 1974).
class CrossValidation {
 public:
  /// Keeps references.
  CrossValidation(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured,
                  const std::vector<ModelTerm>& terms, const SearchedRows& rows, const MissingOptions& options);

  /// samples x d: measured minus predicted, times roots of `weights` of rows (n x d, or empty).
  Eigen::MatrixXd errors(const Missing& answer, const Eigen::MatrixXd& weights) const;

 private:
  const Simulation* simulation_;
  const Recording* recording_;
  const std::vector<ModelTerm>* terms_;
  std::vector<std::string> outputs_;
  std::shared_ptr<ColumnCache> columns_;
  TermData data_;
};

/// Two answers of which neither is e^3, or 20, times as likely as the other cannot be told apart.
inline constexpr double likelihood_margin = 3.0;
/// Functions that differ by no more than this share of one of them are the same.
inline constexpr double same_function = 0.1;

/// The logarithm of the ratio of likelihoods of two answers, from their errors (samples x d) where fits have not used
/// the samples:
///
///     sum_o phi N / 2 ln(S_o / S'_o),    S sums of squares,
///
/// phi the independent share of the samples. Above 0 where `other` is better. Samples beyond 5 of `floors` (d) in both
/// are outliers and do not count.
double log_likelihood_ratio(const Eigen::MatrixXd& found, const Eigen::MatrixXd& other, const Eigen::VectorXd& floors,
                            double independent_share);

/// Whether something is left that no term without a regime explains: more than twice the noise, as far as that is
/// known, and the answer says so, or what is left is alike in neighbouring rows.
bool leaves_something(const Missing& missing);

/// The indices of terms that act in a regime alone.
std::set<std::size_t> terms_of_regimes(const std::vector<ModelTerm>& terms);

/// Of two answers, the one that explains stretches best that no fit has used. `ratio`: log_likelihood_ratio(). Where it
/// is within the margin, rows cannot tell them apart: the one of fewer numbers has the name, the other is its rival,
/// and it is tentative unless both are the same function there. One that is certain is replaced by a certain one alone.
Missing better_of(Missing found, Missing other, double ratio);

/// Runs every contest that applies, in the order of a table: what was found against the answer of a search among other
/// terms. `search`: of the terms given, but for those in the set. `refuted`: terms that are no candidates.
Missing contested(Missing found, const std::vector<ModelTerm>& terms, const std::set<std::size_t>& refuted,
                  const CrossValidation& validation,
                  const std::function<Missing(const std::vector<ModelTerm>&, const std::set<std::size_t>&)>& search);

}  // namespace llmt::discovery
