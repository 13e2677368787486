#include "bytes/option_sets.hpp"

#include <cmath>

namespace bytes {
namespace {

using llmt::Estimation;
using llmt::GrowthRule;
using llmt::LocalTerms;
using llmt::SparseChoice;
using llmt::ValidityChoice;

constexpr int rows = 240;

// Twenty groups of rows. The options hold a view of it.
const std::vector<double>& group_labels() {
  static const std::vector<double> labels = [] {
    Generator generator(31);
    std::vector<double> made;
    for (int row = 0; row < rows; ++row) made.push_back(std::floor(20.0 * generator.uniform()));
    return made;
  }();
  return labels;
}

}  // namespace

const std::vector<GrowthRuleName>& growth_rules() {
  static const std::vector<GrowthRuleName> rules = {
      {"rd", GrowthRule::rd},           {"retis", GrowthRule::retis},
      {"lolimot", GrowthRule::lolimot}, {"lolimot_data_driven", GrowthRule::lolimot_data_driven},
      {"ra", GrowthRule::ra},           {"m5", GrowthRule::m5},
      {"hilomot", GrowthRule::hilomot}};
  return rules;
}

Task make_task(GrowthRule rule, int threads) {
  Task task{make_sample(rows, 1), {}};
  task.options.growth.rule = rule;
  task.options.selection.folds.count = 3;
  task.options.max_threads = threads;
  return task;
}

const std::vector<OptionSet>& option_sets() {
  static const std::vector<OptionSet> sets = {
      {"default", [](Task&) {}},
      {"crisp", [](Task& task) { task.options.blend.validity = ValidityChoice::crisp; }},
      {"blend", [](Task& task) { task.options.blend.validity = ValidityChoice::blend; }},
      {"gaussian", [](Task& task) { task.options.blend.validity = ValidityChoice::gaussian; }},
      {"blend_local",
       [](Task& task) {
         task.options.blend.validity = ValidityChoice::blend;
         task.options.blend.estimation = Estimation::local;
       }},
      {"gaussian_local",
       [](Task& task) {
         task.options.blend.validity = ValidityChoice::gaussian;
         task.options.blend.estimation = Estimation::local;
       }},
      {"local", [](Task& task) { task.options.blend.estimation = Estimation::local; }},
      {"as_grown", [](Task& task) { task.options.blend.estimation = Estimation::as_grown; }},
      {"one_candidate",
       [](Task& task) {
         task.options.blend.widths = {0.75};
         task.options.blend.ridges = {0.0};
         task.options.blend.jumps = {1.5};
         task.options.blend.shrinkages = {0.5};
       }},
      {"quadratic", [](Task& task) { task.options.local_models.terms = LocalTerms::quadratic; }},
      {"quadratic_crisp",
       [](Task& task) {
         task.options.local_models.terms = LocalTerms::quadratic;
         task.options.blend.validity = ValidityChoice::crisp;
       }},
      {"linear_or_quadratic", [](Task& task) { task.options.local_models.terms = LocalTerms::automatic; }},
      {"sparse", [](Task& task) { task.options.local_models.sparse = SparseChoice::always; }},
      {"full_or_sparse", [](Task& task) { task.options.local_models.sparse = SparseChoice::automatic; }},
      {"sparse_quadratic",
       [](Task& task) {
         task.options.local_models.sparse = SparseChoice::always;
         task.options.local_models.terms = LocalTerms::quadratic;
         task.options.blend.validity = ValidityChoice::crisp;
       }},
      {"monotone",
       [](Task& task) {
         task.options.monotone = {1, 0, 0};
       }},
      {"monotone_falling",
       [](Task& task) {
         task.sample.outputs *= -1.0;
         task.options.monotone = {-1, 0, 1};
       }},
      {"monotone_missing",
       [](Task& task) {
         remove_values(task.sample.inputs);
         task.options.monotone = {1, 0, 0};
       }},
      {"slope_signs",
       [](Task& task) {
         task.options.slope_signs = {1, 0, -1};
       }},
      {"slope_signs_crisp",
       [](Task& task) {
         task.options.slope_signs = {1, -1, 0};
         task.options.blend.validity = ValidityChoice::crisp;
       }},
      {"missing", [](Task& task) { remove_values(task.sample.inputs); }},
      {"categorical",
       [](Task& task) {
         make_categorical(task.sample);
         task.options.categorical_inputs = {2};
       }},
      {"categorical_missing_weighted",
       [](Task& task) {
         make_categorical(task.sample);
         remove_values(task.sample.inputs);
         task.options.categorical_inputs = {2};
         task.options.weights = make_weights(task.sample.inputs.rows());
       }},
      {"weighted", [](Task& task) { task.options.weights = make_weights(task.sample.inputs.rows()); }},
      {"two_outputs",
       [](Task& task) {
         add_output(task.sample);
         task.options.blend.validity = ValidityChoice::crisp;
       }},
      {"shared",
       [](Task& task) {
         add_output(task.sample);
         task.options.growth.shared_partition = true;
       }},
      {"weakest_link", [](Task& task) { task.options.growth.pruning = llmt::Pruning::weakest_link; }},
      {"weakest_link_crisp",
       [](Task& task) {
         task.options.growth.pruning = llmt::Pruning::weakest_link;
         task.options.blend.validity = ValidityChoice::crisp;
       }},
      {"binned",
       [](Task& task) {
         task.sample = make_sample(3000, 2);
         task.options.growth.search = llmt::SplitSearch::binned;
         task.options.growth.max_leaves = 12;
         task.options.blend.validity = ValidityChoice::crisp;
         task.options.selection.folds.count = 0;
       }},
      {"no_folds", [](Task& task) { task.options.selection.folds.count = 0; }},
      {"no_folds_blend",
       [](Task& task) {
         task.options.selection.folds.count = 0;
         task.options.blend.validity = ValidityChoice::blend;
         task.options.growth.max_leaves = 8;
       }},
      {"contiguous_folds", [](Task& task) { task.options.selection.folds.kind = llmt::FoldKind::contiguous; }},
      {"grouped_folds", [](Task& task) { task.options.selection.folds.groups = group_labels(); }},
      {"some_columns",
       [](Task& task) {
         task.options.growth.split_inputs = {1};
         task.options.growth.regression_inputs = {0, 2};
       }},
      {"growth_limits",
       [](Task& task) {
         task.options.growth.max_leaves = 6;
         task.options.growth.min_leaf_samples = 15;
         task.options.growth.significance = 0.2;
         task.options.growth.min_variance_gain = 0.01;
       }},
      {"min_improvement",
       [](Task& task) {
         task.options.growth.min_improvement = 0.02;
         task.options.intervals = false;
       }},
  };
  return sets;
}

}  // namespace bytes
