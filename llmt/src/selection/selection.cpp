#include "selection/selection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/parallel.hpp"
#include "estimation/squared_errors.hpp"
#include "llmt/statistics.hpp"
#include "selection/crisp_trees.hpp"
#include "selection/held_out_errors.hpp"
#include "selection/screening.hpp"

namespace llmt {
namespace {

// A model that is less simple has to be better by more than this many standard errors of the gain.
constexpr double standard_errors_of_a_gain = 2.0;

// Share of the work of a comparison that crisp trees take.
constexpr double share_of_crisp = 0.1;

// The best of each width: with jumps only if their gain on none is beyond chance.
std::vector<CandidateError> best_of_widths(const HeldOutErrors& comparison, const std::set<Key>& kept,
                                           const std::vector<FoldRows>& folds, const FoldErrors& error_of_folds) {
  const std::map<Key, std::vector<double>> errors = comparison.errors(folds.size());
  Ranked order = ranked(comparison, folds.size());
  std::erase_if(order, [&](const auto& entry) { return !kept.contains(entry.second); });
  std::vector<CandidateError> result;
  for (const auto& [error, key] : first_of_each(order, [](const Key& each) { return each.form; })) {
    const CandidateError entry = error_of_folds(comparison.candidate(key), errors.at(key));
    const auto same = std::ranges::find_if(result, [&](const CandidateError& other) {
      return other.candidate.validity.width == entry.candidate.validity.width;
    });
    if (same == result.end()) {
      result.push_back(entry);
    } else if (entry.candidate.jump == no_jump && !is_beyond_chance(entry, *same)) {
      *same = entry;
    }
  }
  std::ranges::stable_sort(result, [](const auto& a, const auto& b) { return a.rmse < b.rmse; });
  return result;
}

// Candidates are told apart on samples of the training rows. Against a crisp tree, whose models all rows have made,
// the best blend is at a disadvantage then: it is made from all rows too, where one hold-out says that there are many.
Partition make_from_all_rows(const FoldRows& fold, const GrownTree& grown, const Eigen::VectorXd& weights,
                             int max_threads, const FoldErrors& error_of_folds, Work& work, CandidateError& best) {
  Candidate candidate = best.candidate;
  candidate.leaves = std::min(candidate.leaves, grown.partition.num_leaves());
  Partition partition = estimate(fold.training, grown, candidate, max_threads, work);
  const std::vector<Chunk> held_out = fetch_all(fold.held_out, partition.outputs);
  best = error_of_folds(best.candidate, {squared_errors(partition, fold.training, held_out, weights).sum()});
  return partition;
}

}  // namespace

bool is_beyond_chance(const CandidateError& simple, const CandidateError& other) {
  if (simple.fold_rmse.size() < 2) return other.rmse < simple.rmse;
  const PairedDifference gain = paired_difference(simple.fold_rmse, other.fold_rmse);
  return gain.mean > standard_errors_of_a_gain * gain.standard_error;
}

Selection select(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown, const Candidates& candidates,
                 const Eigen::VectorXd& weights, int max_threads, Work& work) {
  std::vector<FoldRows> compared;
  Selection selection;
  for (const FoldRows& fold : folds) {
    compared.push_back({fold.training, subsample(fold.held_out, most_held_out_rows)});
    selection.held_out_rows += compared.back().held_out.count();
  }
  const FoldErrors error_of_folds(compared, weights.size());
  Work of_crisp(work, share_of_crisp);
  compare_crisp(compared, grown, candidates, weights, max_threads, error_of_folds, of_crisp, selection);
  if (!candidates.widths.empty() && selection.crisp_rmse.size() > 1) {
    HeldOutErrors comparison(compared, grown, candidates, weights, max_threads, work);
    const Eigen::Index coefficients = std::ssize(compared.front().training.regressors) + 1;
    const std::set<Key> kept = compare_in_steps(comparison, candidates, coefficients, compared);
    std::vector<CandidateError> best = best_of_widths(comparison, kept, compared, error_of_folds);
    std::optional<Partition> made;
    if (compared.size() == 1 && !best.empty()) {
      made =
          make_from_all_rows(compared.front(), grown.front(), weights, max_threads, error_of_folds, work, best.front());
    }
    selection.best_of_kind.insert(selection.best_of_kind.end(), best.begin(), best.end());
    if (!candidates.crisp) {
      selection.chosen.rmse = std::numeric_limits<double>::infinity();  // least squares is no candidate
    }
    for (const CandidateError& other : best) {
      selection.chosen =
          other.candidate.jump == no_jump && other.rmse < selection.chosen.rmse ? other : selection.chosen;
    }
    for (const CandidateError& other : best) {
      const bool is_only_one = !std::isfinite(selection.chosen.rmse);
      if (other.candidate.jump < no_jump && (is_only_one || is_beyond_chance(selection.chosen, other))) {
        selection.chosen = other;
      }
    }
    if (made && !best.empty() && selection.chosen.rmse == best.front().rmse) {
      selection.made.push_back(std::move(*made));
    } else if (!made) {
      const auto chosen = std::ranges::find_if(
          kept, [&](const Key& key) { return comparison.candidate(key) == selection.chosen.candidate; });
      if (chosen != kept.end()) selection.made = comparison.models(*chosen);
    }
  }
  work.finish();
  // The best of many candidates gains a little on noise too.
  if (candidates.crisp && compared.size() > 1 && !is_beyond_chance(selection.linear, selection.chosen)) {
    selection.chosen = selection.linear;
    selection.made.clear();
  }
  return selection;
}

}  // namespace llmt
