/// \file
/// How many operations (base/work.hpp) estimates and their comparison take. Fitted to the CPU time of one thread on
/// concrete, airfoil, kin8nm and the benchmarks' function, where an operation is a nanosecond.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "selection/candidates.hpp"

namespace llmt {

/// Sums over rows for a tree whose transitions have this width; 0: crisp.
double operations_of_sums(Eigen::Index rows, Eigen::Index leaves, Eigen::Index coefficients, double width);

/// Joint estimates from the sums, one for each of some regularisations.
double operations_of_solutions(Eigen::Index leaves, Eigen::Index coefficients, Eigen::Index regularisations);

/// One prediction for every row, or a step of conjugate gradients.
double operations_of_pass(Eigen::Index rows, Eigen::Index leaves, double width);

/// One candidate estimated on all rows.
double operations_of_estimate(Eigen::Index rows, const Candidate& candidate, Eigen::Index coefficients);

/// What the comparison of blends in steps (docs/algorithms/selection.md) is still going to take, as far as can be told.
class ExpectedSteps {
 public:
  /// `coefficients`: of a local model; `leaf_counts`: those compared, ascending; `jumps`: number of different jumps.
  ExpectedSteps(const std::vector<FoldRows>& folds, Eigen::Index coefficients, const Candidates& candidates,
                std::vector<Eigen::Index> leaf_counts, std::size_t jumps);

  std::size_t screening() const { return screening_; }  ///< folds of the first steps

  double in_all() const;

  /// The best candidate on all training rows, if they are held out once.
  double on_all_rows() const;

  /// From the round of screening on that begins with the leaf count at `begin`, with `shapes` shapes in the race.
  /// `best`: position of the best leaf count so far.
  double from_round(std::size_t begin, std::size_t shapes, std::size_t best) const;

  /// From the trial of other regularisations on.
  double from_refinement(std::size_t best) const;

  /// On the folds that did not screen.
  double on_other_folds(std::size_t best) const;

 private:
  double middle_width() const { return candidates_.widths[candidates_.widths.size() / 2]; }
  double finalists(std::size_t best) const;
  std::size_t end_of_round(Eigen::Index unknowns) const;
  double of_shape(const FoldRows& fold, double width, std::size_t begin, std::size_t end, Eigen::Index regularisations,
                  bool sums = true) const;
  double on_folds(std::size_t first, std::size_t last, std::size_t begin, std::size_t end, Eigen::Index regularisations,
                  bool sums = true) const;

  const std::vector<FoldRows>& folds_;
  Eigen::Index coefficients_;
  const Candidates& candidates_;
  std::vector<Eigen::Index> counts_;
  std::size_t jumps_;
  std::size_t screening_;
};

/// The leaf counts of a comparison of trees with at most `largest` leaves: 2, 3, 4, 6, 9, ..., each half as large again
/// as the one before, counted from the largest down.
std::vector<Eigen::Index> compared_leaf_counts(Eigen::Index largest);

/// Number of folds on which candidates are screened.
std::size_t screening_folds(const std::vector<FoldRows>& folds);

/// The comparison of crisp trees.
double operations_of_crisp(const std::vector<FoldRows>& folds, Eigen::Index coefficients, Eigen::Index leaves);

/// All that select() takes for trees of about `leaves` leaves.
double operations_of_selection(const std::vector<FoldRows>& folds, Eigen::Index coefficients,
                               const Candidates& candidates, Eigen::Index leaves);

}  // namespace llmt
