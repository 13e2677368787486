#include "fit/defaults.hpp"

#include <algorithm>

namespace llmt {
namespace {

// Of a crisp tree that is grown without a test, to be pruned: of many rows it would have leaves without number.
constexpr Eigen::Index most_pruned_leaves = 1000;

// Leaves on the two sides of splits on monotone inputs are compared in pairs.
constexpr Eigen::Index most_ordered_leaves = 30;

// Whether an input in which the prediction is to be monotone may be split.
bool may_split_monotone(const Table& table) {
  return std::ranges::any_of(table.split_inputs,
                             [&](int input) { return !table.monotone.empty() && table.monotone[input] != 0; });
}

}  // namespace

bool is_lolimot(GrowthRule rule) { return rule == GrowthRule::lolimot || rule == GrowthRule::lolimot_data_driven; }

bool is_hilomot(GrowthRule rule) { return rule == GrowthRule::hilomot; }

Plan make_plan(const FitOptions& options, const TrainingRows& all, Eigen::Index folds) {
  const bool has_folds = folds > 0;
  // Many rows: the widest transitions and the larger ridges, which are for few, take most of the time.
  const bool many_rows = folds == 1;
  Plan plan{options.growth, {}, options.growth.max_leaves > 0};
  const bool is_m5 = options.growth.rule == GrowthRule::m5;
  const ValidityChoice choice = is_lolimot(options.growth.rule) ? ValidityChoice::gaussian
                                : is_m5                         ? ValidityChoice::crisp
                                                                : options.blend.validity;
  const bool logistic = is_hilomot(options.growth.rule);
  const bool crisp_only =
      choice == ValidityChoice::crisp || (choice == ValidityChoice::automatic && !has_folds && !logistic);
  // Every estimate under ordered splits is a quadratic programme, so fewer are tried.
  const bool ordered = may_split_monotone(*all.table);
  plan.candidates.crisp = choice == ValidityChoice::automatic || choice == ValidityChoice::crisp;
  plan.candidates.kind = choice == ValidityChoice::gaussian ? ValidityKind::gaussian
                         : logistic                         ? ValidityKind::logistic
                                                            : ValidityKind::blend;
  plan.candidates.estimation = options.blend.estimation;
  if (!crisp_only) {
    plan.candidates.widths = options.blend.widths;
    if (plan.candidates.widths.empty()) {
      plan.candidates.widths = choice == ValidityChoice::gaussian ? std::vector<double>{1.0 / 3.0}
                               : logistic                         ? std::vector<double>{1.0, 2.0, 4.0}
                               : many_rows                        ? std::vector<double>{0.5, 1.0, 2.0}
                                                                  : std::vector<double>{0.5, 1.0, 2.0, 4.0};
      // Transitions on monotone inputs that overlap share the room that slopes leave them.
      if (ordered) {
        plan.candidates.widths = {0.25, 0.5, 1.0};
      }
    }
    plan.candidates.jumps = options.blend.jumps;
    if (plan.candidates.jumps.empty() || logistic) {
      plan.candidates.jumps = {no_jump};
      if (has_folds && ordered) {
        plan.candidates.jumps.push_back(1.0);
      } else if (has_folds && plan.candidates.kind == ValidityKind::blend) {
        plan.candidates.jumps.insert(plan.candidates.jumps.end(), {4.0, 2.0, 1.0, 0.5});
      }
    }
    if (options.blend.estimation == Estimation::joint) {
      plan.candidates.ridges = options.blend.ridges;
      if (plan.candidates.ridges.empty()) {
        plan.candidates.ridges = ordered     ? std::vector<double>{1e-6, 1e-3}
                                 : many_rows ? std::vector<double>{1e-8, 1e-6, 1e-4, 1e-2}
                                             : std::vector<double>{1e-8, 1e-6, 1e-4, 1e-3, 1e-2, 1e-1};
      }
    }
  }
  plan.candidates.shrinkages = options.blend.shrinkages;
  if (plan.candidates.shrinkages.empty()) {
    plan.candidates.shrinkages = !has_folds || is_m5 ? std::vector<double>{0.0}
                                 : ordered           ? std::vector<double>{0.1}
                                                     : std::vector<double>{0.0, 0.1, 1.0};
  }
  const SparseChoice sparse = options.local_models.sparse;
  plan.candidates.sparse = sparse == SparseChoice::always                   ? std::vector<bool>{true}
                           : sparse == SparseChoice::automatic && has_folds ? std::vector<bool>{false, true}
                                                                            : std::vector<bool>{false};
  GrowthOptions& growth = plan.growth;
  const Eigen::Index regressors = std::ssize(all.regressors);
  const bool many_leaves = !crisp_only && has_folds;
  if (growth.significance < 0.0) {
    // What prunes best-first trees is what splits gain further down, and the held-out error says how far.
    growth.significance = many_leaves || (has_folds && growth.pruning == Pruning::weakest_link) ? 1.0 : 0.05;
  }
  if (growth.min_leaf_samples == 0 && is_m5) {
    growth.min_leaf_samples = 2;  // fewer than four rows are not split (Quinlan 1992)
  }
  if (growth.min_leaf_samples == 0) {
    growth.min_leaf_samples = many_leaves ? std::max<Eigen::Index>(5, regressors) : 2 * (regressors + 1);
  }
  if (growth.max_leaves == 0 && logistic) {
    growth.max_leaves = 50;
  }
  if (growth.max_leaves == 0 && (many_leaves || ordered)) {
    growth.max_leaves = std::clamp<Eigen::Index>(1500 / (regressors + 1), 20, ordered ? most_ordered_leaves : 400);
  }
  if (has_folds && growth.max_leaves == 0 && growth.pruning == Pruning::weakest_link && !is_lolimot(growth.rule)) {
    growth.max_leaves = most_pruned_leaves;
  }
  if (growth.max_leaves == 0 && is_lolimot(growth.rule)) {
    growth.max_leaves = 100;
  }
  return plan;
}

}  // namespace llmt
