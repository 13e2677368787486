// Errors of answers on stretches that their fit has not used.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "discovery/terms/one_search.hpp"
#include "discovery/terms/term_model.hpp"

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

}  // namespace llmt::discovery
