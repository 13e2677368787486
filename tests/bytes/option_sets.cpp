#include "bytes/option_sets.hpp"

#include <cmath>

namespace bytes {
namespace {

using llmt::Estimation;
using llmt::GrowthRule;
using llmt::LocalTerms;
using llmt::SparseChoice;
using llmt::Trend;
using llmt::ValidityChoice;

constexpr int rows = 240;

// Twenty groups of rows.
std::vector<double> group_labels() {
  Generator generator(31);
  std::vector<double> labels;
  for (int row = 0; row < rows; ++row) labels.push_back(std::floor(20.0 * generator.uniform()));
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
  task.options.rule = rule;
  task.options.folds.count = 3;
  task.options.max_threads = threads;
  return task;
}

const std::vector<OptionSet>& option_sets() {
  static const std::vector<OptionSet> sets = {
      {"default", [](Task&) {}},
      {"crisp", [](Task& task) { task.options.validity = ValidityChoice::crisp; }},
      {"blend", [](Task& task) { task.options.validity = ValidityChoice::blend; }},
      {"gaussian", [](Task& task) { task.options.validity = ValidityChoice::gaussian; }},
      {"blend_local",
       [](Task& task) {
         task.options.validity = ValidityChoice::blend;
         task.options.expert.estimation = Estimation::local;
       }},
      {"gaussian_local",
       [](Task& task) {
         task.options.validity = ValidityChoice::gaussian;
         task.options.expert.estimation = Estimation::local;
       }},
      {"local", [](Task& task) { task.options.expert.estimation = Estimation::local; }},
      {"as_grown", [](Task& task) { task.options.expert.estimation = Estimation::as_grown; }},
      {"one_candidate",
       [](Task& task) {
         task.options.expert.widths = {0.75};
         task.options.expert.ridges = {0.0};
         task.options.expert.jumps = {1.5};
         task.options.expert.shrinkages = {0.5};
       }},
      {"quadratic", [](Task& task) { task.options.terms = LocalTerms::quadratic; }},
      {"quadratic_crisp",
       [](Task& task) {
         task.options.terms = LocalTerms::quadratic;
         task.options.validity = ValidityChoice::crisp;
       }},
      {"linear_or_quadratic", [](Task& task) { task.options.terms = LocalTerms::automatic; }},
      {"sparse", [](Task& task) { task.options.sparse = SparseChoice::always; }},
      {"full_or_sparse", [](Task& task) { task.options.sparse = SparseChoice::automatic; }},
      {"sparse_quadratic",
       [](Task& task) {
         task.options.sparse = SparseChoice::always;
         task.options.terms = LocalTerms::quadratic;
         task.options.validity = ValidityChoice::crisp;
       }},
      {"monotone",
       [](Task& task) {
         task.options.trends = {Trend::rising, Trend::any, Trend::any};
       }},
      {"monotone_falling",
       [](Task& task) {
         task.sample.outputs *= -1.0;
         task.options.trends = {Trend::falling, Trend::any, Trend::rising};
       }},
      {"monotone_missing",
       [](Task& task) {
         remove_values(task.sample.inputs);
         task.options.trends = {Trend::rising, Trend::any, Trend::any};
       }},
      {"slope_signs",
       [](Task& task) {
         task.options.trends = {Trend::rising_slopes, Trend::any, Trend::falling_slopes};
       }},
      {"slope_signs_crisp",
       [](Task& task) {
         task.options.trends = {Trend::rising_slopes, Trend::falling_slopes, Trend::any};
         task.options.validity = ValidityChoice::crisp;
       }},
      {"missing", [](Task& task) { remove_values(task.sample.inputs); }},
      {"categorical",
       [](Task& task) {
         make_categorical(task.sample);
         task.known.categorical_inputs = {2};
       }},
      {"categorical_missing_weighted",
       [](Task& task) {
         make_categorical(task.sample);
         remove_values(task.sample.inputs);
         task.known.categorical_inputs = {2};
         task.known.weights = make_weights(task.sample.inputs.rows());
       }},
      {"weighted", [](Task& task) { task.known.weights = make_weights(task.sample.inputs.rows()); }},
      {"two_outputs",
       [](Task& task) {
         add_output(task.sample);
         task.options.validity = ValidityChoice::crisp;
       }},
      {"shared",
       [](Task& task) {
         add_output(task.sample);
         task.options.shared_partition = true;
       }},
      {"weakest_link", [](Task& task) { task.options.pruning = llmt::Pruning::weakest_link; }},
      {"weakest_link_crisp",
       [](Task& task) {
         task.options.pruning = llmt::Pruning::weakest_link;
         task.options.validity = ValidityChoice::crisp;
       }},
      {"binned",
       [](Task& task) {
         task.sample = make_sample(3000, 2);
         task.options.expert.search = llmt::SplitSearch::binned;
         task.options.max_leaves = 12;
         task.options.validity = ValidityChoice::crisp;
         task.options.folds.count = 0;
       }},
      {"no_folds", [](Task& task) { task.options.folds.count = 0; }},
      {"no_folds_blend",
       [](Task& task) {
         task.options.folds.count = 0;
         task.options.validity = ValidityChoice::blend;
         task.options.max_leaves = 8;
       }},
      {"contiguous_folds", [](Task& task) { task.options.folds.kind = llmt::FoldKind::contiguous; }},
      {"grouped_folds", [](Task& task) { task.known.groups = group_labels(); }},
      {"some_columns",
       [](Task& task) {
         task.options.split_inputs = {1};
         task.options.regression_inputs = {0, 2};
       }},
      {"growth_limits",
       [](Task& task) {
         task.options.max_leaves = 6;
         task.options.min_leaf_samples = 15;
         task.options.significance = 0.2;
       }},
  };
  return sets;
}

}  // namespace bytes
