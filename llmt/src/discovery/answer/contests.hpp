// Answers among other terms, their errors on stretches that no fit has used, and which of two answers stands.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "discovery/answer/contests_of_regimes.hpp"
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

  const TermData& data() const { return data_; }
  const Recording& recording() const { return *recording_; }

 private:
  const Simulation* simulation_;
  const Recording* recording_;
  const std::vector<ModelTerm>* terms_;
  std::vector<std::string> outputs_;
  std::shared_ptr<ColumnCache> columns_;
  TermData data_;
};

/// Functions that differ by no more than this share of one of them are the same.
inline constexpr double same_function = 0.1;

/// How much likelier another answer is than the one found.
struct Advantage {
  double log_likelihood = 0.0;  ///< logarithm of the ratio of likelihoods
  double standard_error = 0.0;  ///< of log_likelihood
};

/// Of two answers, from their errors (samples x d) where fits have not used the samples:
///
///     sum_o phi N / 2 ln(S_o / S'_o),    S sums of squares,
///
/// phi the independent share of the samples. Above 0 where `other` is better. Samples beyond 5 of `floors` (d) in both
/// are outliers and do not count. Its variance is that of a sum over blocks of 2 / phi neighbours of
///
///     phi / 2 (N e^2 / S_o - N e'^2 / S'_o),
///
/// by which the likelihoods of single samples scatter (Vuong 1989): large where few samples decide, as those at which a
/// machine reverses.
Advantage advantage(const Eigen::MatrixXd& found, const Eigen::MatrixXd& other, const Eigen::VectorXd& floors,
                    double independent_share);

/// An effect that acts in a regime alone makes deviations larger there than elsewhere. The two inputs, of those where
/// that is not chance, beyond whose thresholds the deviations without terms change their size most: n samples, n' and
/// n'' of them on both sides, have mean squares v, v' and v'' with the largest
///
///     n / 2 ln v - n' / 2 ln v' - n'' / 2 ln v''.
Gates gates_of_size(const CrossValidation& validation, const Missing& found);

/// Of two answers, the one that explains stretches best that no fit has used: by more than two standard errors. Between
/// them rows cannot tell them apart: the one of fewer numbers has the name, the other is its rival, and it is tentative
/// unless both are the same function there. One that is certain is replaced by a certain one alone.
Missing better_of(Missing found, Missing other, const Advantage& of_other);

/// Runs every contest that applies, in the order of a table: what was found against the answer of a search among other
/// terms. `search`: of the terms given, but for those in the set. `refuted`: terms that are no candidates.
Missing contested(Missing found, const std::vector<ModelTerm>& terms, const std::set<std::size_t>& refuted,
                  const CrossValidation& validation,
                  const std::function<Missing(const std::vector<ModelTerm>&, const std::set<std::size_t>&)>& search);

}  // namespace llmt::discovery
