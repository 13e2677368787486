#include "selection/held_out_errors.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "estimation/joint_estimate.hpp"
#include "estimation/local_estimate.hpp"
#include "estimation/squared_errors.hpp"
#include "llmt/statistics.hpp"

namespace llmt {
namespace {

// A threshold that keeps the same jumps of these trees as `jump`, in the middle of the gap between those kept and the
// others: the scores of the tree grown on all rows are a little different.
double middle_of_gap(const std::vector<GrownTree>& grown, double jump) {
  double kept = no_jump;
  double left_out = 0.0;
  for (const GrownTree& tree : grown) {
    for (const double score : tree.jumps) {
      if (score >= jump) {
        kept = std::min(kept, score);
      } else {
        left_out = std::max(left_out, score);
      }
    }
  }
  // If no jump was left out, the next one is assumed at a sixteenth of the smallest kept: the threshold is a quarter.
  return kept < no_jump ? std::sqrt(kept * std::max(left_out, kept / 16.0)) : no_jump;
}

// The leaf counts of a comparison of trees with at most `largest` leaves.
std::vector<Eigen::Index> compared_leaf_counts(Eigen::Index largest) {
  std::vector<Eigen::Index> counts;
  for (Eigen::Index count = largest; count > 1; count = std::min(count - 1, (count * 2 + 1) / 3)) {
    counts.push_back(count);
  }
  std::ranges::reverse(counts);
  return counts;
}

// About the share of the work left in a comparison that an evaluation takes.
constexpr double share_of_evaluation = 0.4;

}  // namespace

Eigen::Index enough_rows(Eigen::Index leaves, Eigen::Index coefficients) {
  constexpr Eigen::Index rows_per_unknown = 25;
  constexpr Eigen::Index smallest_sample = 10000;
  return std::max(smallest_sample, rows_per_unknown * leaves * coefficients);
}

HeldOutErrors::HeldOutErrors(const std::vector<FoldRows>& folds, const std::vector<GrownTree>& grown,
                             const Candidates& candidates, const Eigen::VectorXd& weights, int max_threads, Work& work)
    : folds_(folds),
      grown_(grown),
      candidates_(candidates),
      weights_(weights),
      max_threads_(max_threads),
      work_(work),
      of_folds_(folds.size()) {
  std::set<Eigen::Index> seen;
  for (const double jump : candidates.jumps) {
    Eigen::Index kept = 0;
    for (const GrownTree& tree : grown) {
      kept += (tree.jumps.array() >= jump).count();
    }
    if (seen.insert(kept).second) {
      for (const double width : candidates.widths) {
        forms_.push_back({width, middle_of_gap(grown, jump)});
      }
    }
  }
  Eigen::Index largest = 1;
  for (const GrownTree& tree : grown) {
    largest = std::max(largest, tree.partition.num_leaves());
  }
  leaf_counts_ = compared_leaf_counts(largest);
  for (const FoldRows& fold : folds) {
    held_out_.push_back(fetch_all(fold.held_out, grown.front().partition.outputs));
    const Eigen::Index enough = enough_rows(largest, std::ssize(fold.training.regressors) + 1);
    samples_.push_back(subsample(fold.training, enough, max_threads));
  }
}

Candidate HeldOutErrors::candidate(const Key& key) const {
  return {.validity = {candidates_.kind, forms_[key.form].width},
          .jump = forms_[key.form].jump,
          .estimation = candidates_.estimation,
          .ridge = candidates_.ridges.empty() ? 0.0 : candidates_.ridges[key.ridge],
          .shrinkage = candidates_.shrinkages[key.shrinkage],
          .sparse = candidates_.sparse[key.sparse],
          .leaves = leaf_counts_[key.leaves]};
}

// As many rows as a tree needs, and the sums over them.
struct HeldOutErrors::Sample {
  Sample(const TrainingRows& all, Partition tree, int max_threads, bool sparse)
      : rows(subsample(all, rows_for(all, tree.num_leaves()), max_threads)),
        sums(sum_leaves(rows, std::move(tree), max_threads, sparse)) {}
  Sample(const Sample&) = delete;
  Sample& operator=(const Sample&) = delete;

  static Eigen::Index rows_for(const TrainingRows& all, Eigen::Index leaves) {
    return std::min(all.count(), enough_rows(leaves, std::ssize(all.regressors) + 1));
  }
  /// Whether a sample for this prefix of the tree would consist of the same rows.
  bool serves(const TrainingRows& all, Eigen::Index leaves) const {
    const Eigen::Index summed = sums.partition.num_leaves();
    return leaves <= summed && rows_for(all, leaves) == rows_for(all, summed);
  }

  const TrainingRows rows;
  const LeafSums sums;
};

// One form; `keys` ascending.
HeldOutErrors::Evaluated HeldOutErrors::evaluate_form(std::size_t fold, const std::vector<Key>& keys, bool keeps_models,
                                                      std::shared_ptr<Sample>& last, Work& work, double share) const {
  const Candidate first = candidate(keys.front());
  const Partition tree = blended(samples_[fold], grown_[fold], first.validity, first.jump);
  std::vector<std::vector<Key>> of_counts;  // of each number of leaves, the largest first, which takes longest
  for (auto key = keys.rbegin(); key != keys.rend(); ++key) {
    if (of_counts.empty() || of_counts.back().front().leaves != key->leaves) of_counts.emplace_back();
    of_counts.back().push_back(*key);
  }
  const auto sample_for = [&](const std::vector<Key>& same, std::shared_ptr<Sample>& sample) {
    const Eigen::Index leaves = std::min(leaf_counts_[same.front().leaves], tree.num_leaves());
    if (sample && sample->serves(samples_[fold], leaves)) return;
    sample = std::make_shared<Sample>(samples_[fold], prefix(tree, leaves), max_threads_, candidates_.sparse.back());
    work.check();
  };
  // The sums of a tree serve all its prefixes. This does not hold for Gaussians, whose prefixes have validities of
  // their own.
  const bool shares_sums = candidates_.kind != ValidityKind::gaussian;
  if (shares_sums) sample_for(of_counts.front(), last);
  std::vector<Evaluated> evaluated(of_counts.size());
  parallel_for(std::ssize(of_counts), max_threads_, [&](Eigen::Index index) {
    const std::vector<Key>& same = of_counts[index];
    std::shared_ptr<Sample> own;
    if (!shares_sums) sample_for(same, own);
    evaluated[index] = evaluate_prefix(fold, own ? *own : *last, same, keeps_models);
    work.did(share * static_cast<double>(same.size()));
  });
  Evaluated result;
  for (Evaluated& each : evaluated) {
    result.errors.merge(each.errors);
    result.models.merge(each.models);
  }
  return result;
}

// Candidates of one form and leaf count.
HeldOutErrors::Evaluated HeldOutErrors::evaluate_prefix(std::size_t fold, const Sample& sample,
                                                        const std::vector<Key>& keys, bool keeps_models) const {
  const Eigen::Index leaves = std::min(leaf_counts_[keys.front().leaves], sample.sums.partition.num_leaves());
  std::vector<Regularisation> regularisations;
  for (const Key& key : keys) {
    const Candidate each = candidate(key);
    regularisations.push_back({each.ridge, each.shrinkage, each.sparse});
  }
  std::vector<Partition> models;
  if (candidates_.estimation == Estimation::joint) {
    models = joint(sample.sums, leaves, regularisations);
  } else {
    for (const Regularisation& each : regularisations) {
      models.push_back(candidates_.estimation == Estimation::local
                           ? local(sample.sums, leaves, each.shrinkage, each.sparse)
                           : as_grown(sample.sums, leaves));
    }
  }
  std::vector<Eigen::VectorXd> errors = squared_errors(models, folds_[fold].held_out, held_out_[fold], weights_);
  Evaluated result;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    result.errors[keys[i]] = std::move(errors[i]);
    if (keeps_models && sample.rows.count() == folds_[fold].training.count()) {
      result.models[keys[i]] = std::move(models[i]);
    }
  }
  return result;
}

void HeldOutErrors::evaluate(const std::set<Key>& keys, std::size_t folds, bool keeps_models) {
  struct Task {
    std::size_t fold;
    std::vector<Key> keys;
    Evaluated evaluated;
    std::shared_ptr<Sample>* sample = nullptr;
  };
  std::vector<Task> tasks;
  std::set<std::pair<std::size_t, std::size_t>> used;
  double count = 0.0;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::map<std::size_t, std::vector<Key>> of_form;
    for (const Key& key : keys) {
      if (!of_folds_[fold].errors.contains(key)) {
        of_form[key.form].push_back(key);
      }
    }
    for (auto& [form, missing] : of_form) {
      count += static_cast<double>(missing.size());
      tasks.push_back({fold, std::move(missing), {}, &last_[{fold, form}]});
      used.insert({fold, form});
    }
  }
  if (tasks.empty()) return;
  std::erase_if(last_, [&](const auto& entry) { return !used.contains(entry.first); });
  Work work(work_, share_of_evaluation * work_.left());
  parallel_for(std::ssize(tasks), max_threads_, [&](Eigen::Index index) {
    Task& task = tasks[index];
    task.evaluated = evaluate_form(task.fold, task.keys, keeps_models, *task.sample, work, 1.0 / count);
  });
  for (Task& task : tasks) {
    of_folds_[task.fold].errors.merge(task.evaluated.errors);
    of_folds_[task.fold].models.merge(task.evaluated.models);
  }
}

std::vector<std::optional<Partition>> HeldOutErrors::models(const Key& key) const {
  std::vector<std::optional<Partition>> result;
  for (const Evaluated& of_fold : of_folds_) {
    const auto found = of_fold.models.find(key);
    result.push_back(found != of_fold.models.end() ? std::optional(found->second) : std::nullopt);
  }
  return result;
}

bool HeldOutErrors::is_clearly_worse(const Key& key, const Key& best, std::size_t folds) const {
  constexpr double standard_errors = 3.0;
  Eigen::VectorXd of_key(static_cast<Eigen::Index>(folds) * error_parts);
  Eigen::VectorXd of_best(of_key.size());
  for (std::size_t fold = 0; fold < folds; ++fold) {
    const Eigen::Index begin = static_cast<Eigen::Index>(fold) * error_parts;
    of_key.segment(begin, error_parts) = of_folds_[fold].errors.at(key);
    of_best.segment(begin, error_parts) = of_folds_[fold].errors.at(best);
  }
  const PairedDifference difference = paired_difference(of_key, of_best);
  return difference.mean > standard_errors * difference.standard_error;
}

std::map<Key, std::vector<double>> HeldOutErrors::errors(std::size_t folds) const {
  std::map<Key, std::vector<double>> result;
  for (const auto& [key, error] : of_folds_.front().errors) {
    std::vector<double> all;
    for (std::size_t fold = 0; fold < folds && of_folds_[fold].errors.contains(key); ++fold) {
      all.push_back(of_folds_[fold].errors.at(key).sum());
    }
    if (all.size() == folds) {
      result[key] = std::move(all);
    }
  }
  return result;
}

}  // namespace llmt
