/// \file
/// Held-out errors of the candidates of a fit, computed once each.
#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "llmt/progress.hpp"
#include "selection/candidates.hpp"

namespace llmt {

/// The form of a blend, from which the half widths of the transitions come.
struct BlendForm {
  double width = 0.0;
  double jump = no_jump;
};

/// Position of a candidate among blend forms, leaf counts, ridges, shrinkages and what is sparse.
struct Key {
  std::size_t form = 0;
  std::size_t leaves = 0;
  std::size_t ridge = 0;
  std::size_t shrinkage = 0;
  std::size_t sparse = 0;
  auto operator<=>(const Key&) const = default;
};

/// Number of training rows on which candidates are compared: 25 for each unknown, with which a joint estimate adds 4 %
/// to the variance of the noise. The ratio is the same for all candidates, so that none looks better for having more
/// rows.
Eigen::Index enough_rows(Eigen::Index leaves, Eigen::Index coefficients);

class HeldOutErrors {
 public:
  /// `work`: counts the evaluations.
  HeldOutErrors(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown, const Candidates& candidates,
                const Eigen::VectorXd& weights, int max_threads, Work& work);

  /// All widths with all jumps, but for those that keep the same splits crisp as one before.
  const std::vector<BlendForm>& forms() const { return forms_; }
  /// 2, 3, 4, 6, 9, ..., the largest tree's: each half as large again as the one before, counted from the largest down.
  const std::vector<Eigen::Index>& leaf_counts() const { return leaf_counts_; }

  /// Evaluates on the first `folds` folds what was not before. `keeps_models`: and keeps the models of what is new if
  /// they are made from all training rows of their fold.
  void evaluate(const std::set<Key>& keys, std::size_t folds, bool keeps_models = false);

  /// The models of a candidate that were kept, one a fold.
  std::vector<std::optional<Partition>> models(const Key& key) const;

  /// The sums of squared errors of each of the first `folds` folds, for all keys that these have.
  std::map<Key, std::vector<double>> errors(std::size_t folds) const;

  /// Whether the held-out rows of the first `folds` folds say beyond doubt that `key` predicts worse than `best`: by
  /// the differences of the sums of squared errors over parts of these rows, (C.3) of docs/algorithms/selection.md.
  bool is_clearly_worse(const Key& key, const Key& best, std::size_t folds) const;

  Candidate candidate(const Key& key) const;

 private:
  /// Squared errors, summed over parts of the held-out rows, and models.
  struct Evaluated {
    std::map<Key, Eigen::VectorXd> errors;
    std::map<Key, Partition> models;
  };

  struct Sample;  ///< of a fold's rows, with the sums over it

  /// `last`: the form's last sample, or none; afterwards the one that was used. `work`: of this evaluation, and
  /// `share`: that of a key in it.
  Evaluated evaluate_form(std::size_t fold, const std::vector<Key>& keys, bool keeps_models,
                          std::shared_ptr<Sample>& last, Work& work, double share) const;
  Evaluated evaluate_prefix(std::size_t fold, const Sample& sample, const std::vector<Key>& keys,
                            bool keeps_models) const;

  const std::vector<FoldRows>& folds_;
  const std::vector<GrownTree>& grown_;
  const Candidates& candidates_;
  const Eigen::VectorXd& weights_;
  int max_threads_;
  Work& work_;
  std::vector<BlendForm> forms_;
  std::vector<Eigen::Index> leaf_counts_;
  std::vector<TrainingRows> samples_;         // of the folds' training rows, enough for the largest tree
  std::vector<std::vector<Chunk>> held_out_;  // of the folds
  std::vector<Evaluated> of_folds_;
  std::map<std::pair<std::size_t, std::size_t>, std::shared_ptr<Sample>> last_;  // of a fold and form, of the last step
};

}  // namespace llmt
