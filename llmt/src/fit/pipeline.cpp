#include "fit/pipeline.hpp"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "fit/assemble.hpp"
#include "fit/choices/input_choice.hpp"
#include "fit/term_choice.hpp"
#include "fit/trees/error_weights.hpp"
#include "fit/trees/grow_tree.hpp"
#include "fit/trees/held_out_error.hpp"

namespace llmt {
namespace {

// The tree of all rows, and those of the folds with the best candidate.
struct GrownTrees {
  FinalTree of_all;
  HeldOutFits of_folds;
};

GrownTrees grow_and_choose(const Training& training, const Plan& plan, const std::vector<int>& served, Work& work) {
  GrownTrees trees;
  const int threads = training.options.max_threads;
  const bool has_folds = !training.folds.empty();
  // Work is counted in trees: one of each fold, two more for the choice there, that of all rows, and one to finish.
  const double of_folds = 3.0 * static_cast<double>(training.folds.size());
  const double share = work.left() / (of_folds + 2.0);
  Work choosing(work, of_folds * share);
  Work growing(work, share);
  const auto grow = [&] {
    trees.of_all = grow_tree(training.all, served, plan, !has_folds, threads, growing);
    refuse_beyond_memory(training, plan, trees.of_all.tree.partition.num_leaves());
  };
  if (has_folds && training.kept->is_fold_given) {  // which trains on the rows of the model: one tree serves both
    grow();
    trees.of_folds = held_out_error(training, plan, served, choosing, &trees.of_all.tree);
    return trees;
  }
  // The tree of all rows needs nothing of the folds. Beside them it is work for the threads that would idle, because a
  // tree has ever less to do for several threads the smaller its leaves become.
  parallel_for(2, threads, [&](Eigen::Index job) {
    if (job == 1) {
      grow();
    } else if (has_folds) {
      trees.of_folds = held_out_error(training, plan, served, choosing);
    }
  });
  return trees;
}

}  // namespace

// A model is y(x) = sum_l v_l(x) (c_l + b_l^T (x - x_0)). Growth decides on the boxes of the leaves l. What makes the
// error e of held-out rows least, e^2 = sum_i w_i (y_i - y(x_i))^2 / sum_i w_i, decides on everything else: which
// inputs are codes, the terms in x, the inputs in x, how many leaves stay, their validities v_l, and how c_l and b_l
// are estimated.
FitResult fit(const PreparedRows& rows, Work& work) {
  std::vector<FitResult> fits;
  const double whole = work.left();
  for (const auto& [terms, share] : terms_to_compare(rows)) {
    Work of_terms(work, share * whole);
    const std::shared_ptr<const Training> training = with_terms(rows.training, terms, of_terms);
    const FitOptions& options = training->options;
    refuse_beyond_memory(*training, plan_of(*training), 0);
    const std::vector<std::vector<int>> groups = output_groups(training->outputs(), options.shared_partition);
    std::vector<std::optional<FittedPartition>> fitted(groups.size());
    const double share_of_partition = of_terms.left() / static_cast<double>(groups.size());
    // With a single hold-out rows are many, and one tree has work for all threads: several at a time would only hold
    // more rows in memory.
    const int groups_at_once = training->folds.size() == 1 ? 1 : options.max_threads;
    parallel_for(std::ssize(groups), groups_at_once, [&](Eigen::Index p) {
      Work of_partition(of_terms, share_of_partition);
      const ChosenInputs inputs = choose_inputs(training, groups[p], of_partition);
      const Plan plan = plan_of(*inputs.training);
      GrownTrees trees = grow_and_choose(*inputs.training, plan, groups[p], of_partition);
      fitted[p] = finish(inputs, plan, trees.of_all, std::move(trees.of_folds), of_partition);
    });
    fits.push_back(assemble(*training, std::move(fitted)));
    of_terms.finish();
  }
  return with_choices(better_of(std::move(fits)), rows);
}

}  // namespace llmt
