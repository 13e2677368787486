#include "selection/merge_selection.hpp"

#include <algorithm>
#include <map>

#include "base/parallel.hpp"
#include "estimation/joint_fit.hpp"
#include "selection/held_out_errors.hpp"
#include "selection/judge.hpp"

namespace llmt {
namespace {

/// Larger trees than the chosen one, as multiples of its leaves: merged, they may have as few local models.
constexpr std::ptrdiff_t largest_multiple = 3;

/// From one number of local models to the next: all up to 8, then an eighth fewer each time.
std::ptrdiff_t next_fewer(std::ptrdiff_t count) { return count - std::max<std::ptrdiff_t>(1, count / 8); }

/// The chosen number of leaves, then half as many more each time.
std::vector<std::ptrdiff_t> leaf_counts(std::ptrdiff_t chosen, std::ptrdiff_t largest) {
  std::vector<std::ptrdiff_t> counts;
  for (std::ptrdiff_t count = chosen; count <= std::min(largest, largest_multiple * chosen);
       count = (3 * count + 1) / 2) {
    counts.push_back(count);
  }
  return counts;
}

Partition made(const JointFit& fit, const Candidate& candidate, std::ptrdiff_t leaves) {
  if (candidate.validity.kind == ValidityKind::crisp) {
    return candidate.sparse || candidate.shrinkage > 0.0 ? fit.local(leaves, candidate.shrinkage, candidate.sparse)
                                                         : fit.as_grown(leaves);
  }
  switch (candidate.estimation) {
    case Estimation::as_grown:
      return fit.as_grown(leaves);
    case Estimation::local:
      return fit.local(leaves, candidate.shrinkage, candidate.sparse);
    case Estimation::joint:
      break;
  }
  return std::move(fit.joint(leaves, {{candidate.ridge, candidate.shrinkage, candidate.sparse}}).front());
}

/// Squared errors by number of local models, from that of the leaves down to 1. A tree with fewer leaves than the
/// candidate has no more local models than leaves.
std::map<std::ptrdiff_t, double> errors_of_merges(const FoldRows& fold, const GrownTree& grown,
                                                  const Candidate& candidate, const Eigen::VectorXd& weights,
                                                  int max_threads) {
  const std::ptrdiff_t leaves = std::min(candidate.leaves, grown.partition.num_leaves());
  TrainingRows rows = fold.training;
  if (candidate.validity.kind != ValidityKind::crisp) {
    rows = thinned(rows, enough_rows(leaves, std::ssize(rows.regressors) + 1));
  }
  Partition partition = prefix(blended(rows, grown, candidate.validity, candidate.jump), leaves);
  JointFit fit(rows, std::move(partition), max_threads, candidate.sparse);
  std::vector<Chunk> held_out;
  for (std::ptrdiff_t index = 0; index < num_chunks(fold.held_out); ++index) {
    held_out.push_back(fetch(fold.held_out, index, grown.partition.outputs));
  }
  const std::vector<Merge> merges = fit.merges();
  std::map<std::ptrdiff_t, double> errors;
  std::size_t next = 0;
  double error = 0.0;
  for (std::ptrdiff_t count = candidate.leaves; count >= 1; count = next_fewer(count)) {
    for (; leaves - static_cast<std::ptrdiff_t>(next) > count; ++next) {
      fit.share(merges[next]);
    }
    if (count <= leaves || errors.empty()) {
      error = squared_error(made(fit, candidate, leaves), fold.training, held_out, weights);
    }
    errors[count] = error;
  }
  return errors;
}

}  // namespace

void choose_local_models(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown,
                         const Eigen::VectorXd& weights, int max_threads, Selection& selection) {
  const Candidate chosen = selection.chosen.candidate;
  std::ptrdiff_t largest = 1;
  for (const GrownTree& tree : grown) {
    largest = std::max(largest, tree.partition.num_leaves());
  }
  if (chosen.leaves < 2) {
    return;
  }
  const std::vector<std::ptrdiff_t> counts = leaf_counts(chosen.leaves, largest);
  std::vector<std::vector<std::map<std::ptrdiff_t, double>>> errors(
      counts.size(), std::vector<std::map<std::ptrdiff_t, double>>(folds.size()));
  parallel_for(std::ssize(folds) * std::ssize(counts), max_threads, [&](std::ptrdiff_t task) {
    const std::size_t f = static_cast<std::size_t>(task) % folds.size();
    const std::size_t c = static_cast<std::size_t>(task) / folds.size();
    Candidate candidate = chosen;
    candidate.leaves = counts[c];
    errors[c][f] = errors_of_merges(folds[f], grown[f], candidate, weights, max_threads);
  });
  const Judge judge(folds, weights.size());
  const auto error_of = [&](std::size_t c, std::ptrdiff_t local_models) {
    Candidate candidate = chosen;
    candidate.leaves = counts[c];
    candidate.local_models = local_models;
    std::vector<double> of_folds;
    for (const std::map<std::ptrdiff_t, double>& fold : errors[c]) {
      of_folds.push_back(fold.at(local_models));
    }
    return judge(candidate, of_folds);
  };
  CandidateError best = error_of(0, chosen.leaves);
  const double unmerged = best.rmse;
  for (std::size_t c = 0; c < counts.size(); ++c) {
    for (std::ptrdiff_t count = next_fewer(counts[c]); count >= 1; count = next_fewer(count)) {
      const CandidateError other = error_of(c, count);
      best = other.rmse < best.rmse || (other.rmse == best.rmse && count < best.candidate.local_models) ? other : best;
    }
  }
  if (best.candidate.local_models < best.candidate.leaves && best.rmse <= unmerged) {
    selection.chosen = best;
    selection.made.clear();
  }
}

}  // namespace llmt
