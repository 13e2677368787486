#include "llmt/readable.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>

#include "base/count.hpp"
#include "base/parallel.hpp"
#include "estimation/leaf_statistics.hpp"
#include "fit/choices/code_choice.hpp"
#include "fit/named.hpp"
#include "fit/prepared_rows.hpp"
#include "fit/trees/error_weights.hpp"
#include "growth/rules/rule.hpp"
#include "llmt/size.hpp"
#include "llmt/statistics.hpp"
#include "model/codes.hpp"
#include "model/held_out_intervals.hpp"
#include "readable/input_walk.hpp"
#include "readable/path.hpp"
#include "selection/fold_errors.hpp"
#include "selection/selection.hpp"

namespace llmt {
namespace {

// Held-out errors below this part of that of a constant are rounding.
constexpr double rounding_error = 1e-8;

// A tree that has more rules than another and not this much less error does not pay.
constexpr double least_gain_of_step = 0.01;

void check(const FitOptions& options, const FitSummary& fitted, const ReadableOptions& asked) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument("llmt::fit_readable: " + what); };
  if (!(asked.loss >= 0.0 && std::isfinite(asked.loss))) {
    refuse(fmt::format("loss is {}, it must be a finite number, 0 or more", asked.loss));
  }
  if (asked.rules < 0) refuse(fmt::format("rules is {}, it must be 1 or more, or 0 for the default", asked.rules));
  if (const std::string why = why_not_readable(options); !why.empty())
    refuse("a readable tree does not go with " + why);
  if (fitted.partitions.empty() || fitted.partitions.front().cv_folds == 0) {
    refuse("no row was held out in the fit, and the tree is chosen by its error on held-out rows");
  }
}

// Everything but what is asked of the choice.
struct Setting {
  const Training& training;            // linear local models
  const std::vector<FoldRows>& folds;  // held-out rows as in the fit: of many a sample
  TreePlan plan;
};

std::vector<Sample> samples_of(const Setting& setting, const std::vector<int>& served) {
  const Eigen::VectorXd weights = error_weights(*setting.training.table, served);
  // The last one is that of all rows.
  std::vector<Sample> samples(setting.folds.size() + 1);
  parallel_for(std::ssize(samples), setting.plan.max_threads, [&](Eigen::Index f) {
    const bool is_fold = f < std::ssize(setting.folds);
    const TrainingRows* held_out = is_fold ? &setting.folds[f].held_out : nullptr;
    samples[f] = make_sample(is_fold ? setting.folds[f].training : setting.training.all, held_out, served, weights);
  });
  return samples;
}

std::vector<ComparedTree> compared_trees(const std::vector<std::vector<WalkStep>>& walks) {
  const std::vector<WalkStep>& final_walk = walks.back();
  std::vector<ComparedTree> trees;
  for (TreeKey key; key.step < final_walk.size(); ++key.step) {
    for (key.form = 0; key.form < final_walk[key.step].trees.size(); ++key.form) {
      for (key.price = 0; key.price < final_walk[key.step].trees[key.form].size(); ++key.price) {
        ComparedTree& tree = trees.emplace_back(ComparedTree{key, forms()[key.form].products, {}, {}});
        for (std::size_t f = 0; f < walks.size(); ++f) {
          const JudgedTree& judged = walks[f][key.step].trees[key.form][key.price];
          tree.extents.push_back(judged.extent);
          if (f + 1 < walks.size()) tree.squares.push_back(judged.held_out_error);
        }
      }
    }
  }
  return trees;
}

// By which trees a path is measured. `trees`: as compared_trees(), the first a constant.
PathRule path_rule(const Setting& setting, const PartitionSummary& partition, const std::vector<ComparedTree>& trees,
                   double loss) {
  PathRule rule{.loss = loss, .least = 0.0, .weights = {}, .crisp_squares = {}};
  const double outputs = static_cast<double>(partition.outputs.size());
  for (const FoldRows& fold : setting.folds) rule.weights.push_back(total_weight(fold.held_out) * outputs);
  for (const CandidateError& error : partition.best_of_kind) {
    if (error.candidate.validity.kind != ValidityKind::crisp || error.fold_rmse.size() != std::ssize(rule.weights))
      continue;
    std::vector<double>& squares = rule.crisp_squares.emplace_back();
    for (std::size_t f = 0; f < rule.weights.size(); ++f)
      squares.push_back(rule.weights[f] * error.fold_rmse(f) * error.fold_rmse(f));
  }
  const double constant = std::sqrt(sum_of(trees.front().squares) / sum_of(rule.weights));
  rule.least = rounding_error * constant;
  return rule;
}

// What was chosen, and which trees the same choice takes where it does not see the held-out rows of a fold.
struct Choice {
  std::vector<ReadableStep> steps;
  std::size_t taken = 0;
  double yardstick = 0.0;
  bool is_within_loss = true;
  std::vector<TreeKey> keys;  ///< of the folds and, last, of all rows
};

Choice choose(const Setting& setting, const std::vector<std::vector<WalkStep>>& walks,
              const PartitionSummary& partition, const ReadableOptions& options) {
  const std::vector<ComparedTree> trees = compared_trees(walks);
  const PathRule rule = path_rule(setting, partition, trees, options.loss);
  const int folds = count_of(setting.folds);
  const Path path = path_of(trees, rule, -1);
  // What is said of a step is the error of the choice itself: in each fold that of the tree which the other folds
  // choose. A single fold has no others, and many rows.
  std::vector<Path> of_others;
  for (int f = 0; f < folds; ++f) of_others.push_back(folds > 1 ? path_of(trees, rule, f) : path);
  const auto tree_of = [&](std::size_t step, int f) {
    const Path& other = of_others[f];
    return other.steps[step == path.chosen ? other.chosen : other.with_rules(path.rules[step])];
  };
  const FoldErrors error_of_folds(setting.folds, std::ssize(partition.outputs));
  Choice choice{
      .steps = {}, .taken = 0, .yardstick = path.yardstick, .is_within_loss = path.is_within_loss, .keys = {}};
  double smallest = std::numeric_limits<double>::infinity();
  std::size_t taken = path.chosen;
  for (std::size_t step = 0; step < path.steps.size(); ++step) {
    std::vector<double> squares;
    for (int f = 0; f < folds; ++f) squares.push_back(trees[tree_of(step, f)].squares[f]);
    const CandidateError error = error_of_folds({}, squares);
    if (step != path.chosen && !(error.rmse < (1.0 - least_gain_of_step) * smallest)) continue;
    smallest = std::min(smallest, error.rmse);
    const bool is_asked = choice.steps.empty() || path.rules[step] <= options.rules;
    if (options.rules > 0 ? is_asked : step == path.chosen) {
      taken = step;
      choice.taken = choice.steps.size();
    }
    const TreeExtent& extent = trees[path.steps[step]].extents.back();
    choice.steps.push_back({extent.rules, extent.most_terms, extent.size, error.rmse, error.spread, error.fold_rmse});
  }
  for (int f = 0; f < folds; ++f) choice.keys.push_back(trees[tree_of(taken, f)].key);
  choice.keys.push_back(trees[path.steps[taken]].key);
  return choice;
}

// The chosen tree of one fold, or of all rows.
struct ChosenTree {
  EquationTree tree;
  std::vector<int> pruned;
};

// The readable trees of one partition: those of the folds and, last, that of all rows.
struct ReadableTrees {
  std::vector<Sample> samples;
  std::vector<std::optional<ChosenTree>> trees;
  Choice choice;
};

std::unique_ptr<ReadableTrees> find_trees(const Setting& setting, const PartitionSummary& partition,
                                          const ReadableOptions& options, Work& work) {
  auto made = std::make_unique<ReadableTrees>();
  made->samples = samples_of(setting, partition.outputs);
  const Eigen::Index count = std::ssize(made->samples);
  std::vector<std::vector<WalkStep>> walks(count);
  constexpr double share_of_walks = 0.9;
  parallel_for(count, setting.plan.max_threads, [&](Eigen::Index f) {
    Work walk(work, share_of_walks / static_cast<double>(count));
    walks[f] = walk_inputs(made->samples[f], setting.plan, walk);
  });
  made->choice = choose(setting, walks, partition, options);
  made->trees.resize(count);
  parallel_for(count, setting.plan.max_threads, [&](Eigen::Index f) {
    if (!setting.training.options.intervals && f + 1 < count) return;
    const TreeKey& key = made->choice.keys[f];
    EquationTree tree = make_tree(made->samples[f], setting.plan, walks[f][key.step], forms()[key.form]);
    std::vector<int> pruned = tree.pruned(price_of(tree, key.price));
    made->trees[f].emplace(ChosenTree{std::move(tree), std::move(pruned)});
    work.check();
  });
  return made;
}

// The model of one fold, or of all rows, with a partition from each of `parts`.
Model assemble(const std::vector<std::unique_ptr<ReadableTrees>>& parts, std::size_t at, int max_threads, Work& work) {
  std::vector<Term> products;
  for (const auto& part : parts) {
    for (const Term& term : part->trees[at]->tree.products_in(part->trees[at]->pruned)) {
      const auto is_term = [&](const Term& other) { return other.first == term.first && other.second == term.second; };
      if (std::ranges::none_of(products, is_term)) products.push_back(term);
    }
  }
  TrainingRows described = parts.front()->samples[at].described;
  for (const Term& term : products) {
    described.regressors.push_back({.input = described.regressors[term.first].input,
                                    .level = -1,
                                    .centre = 0.0,
                                    .second_input = described.regressors[term.second].input});
  }
  std::vector<Partition> partitions;
  for (const auto& part : parts) {
    Partition& partition = partitions.emplace_back(part->trees[at]->tree.partition(part->trees[at]->pruned, products));
    describe_leaves(described, partition, true, max_threads, work);
  }
  return {described.columns, described.output_columns, described.regressors, std::move(partitions)};
}

ReadablePartition describe(const Model& model, std::size_t p, const Choice& choice) {
  const Partition& partition = model.partitions()[p];
  ReadablePartition result{.outputs = partition.outputs, .leaves = partition.num_leaves()};
  std::set<int> inputs;
  for (const Node& node : partition.nodes) {
    if (!node.is_leaf()) {
      inputs.insert(node.split_input);
      continue;
    }
    Eigen::Index terms = 0;
    for (Eigen::Index k = 0; k < node.slope.cols(); ++k) {
      if (node.slope.col(k).isZero(0.0)) continue;
      ++terms;
      inputs.insert(model.regressors()[k].input);
      if (const int second = model.regressors()[k].second_input; second >= 0) inputs.insert(second);
    }
    result.most_terms = std::max(result.most_terms, terms);
  }
  result.used_inputs = std::ssize(inputs);
  std::vector<OutputColumn> outputs;
  Partition alone = partition;
  for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
    outputs.push_back(model.outputs()[partition.outputs[o]]);
    alone.outputs[o] = static_cast<int>(o);
  }
  result.size = expression_size(Model(model.inputs(), outputs, model.regressors(), {alone}));
  const ReadableStep& taken = choice.steps[choice.taken];
  result.rmse = taken.rmse;
  result.fold_rmse = taken.fold_rmse;
  result.spread = taken.spread;
  result.path = choice.steps;
  result.taken = choice.taken;
  result.yardstick = choice.yardstick;
  result.is_within_loss = choice.is_within_loss;
  return result;
}

Intervals intervals_of(const Setting& setting, const std::vector<std::unique_ptr<ReadableTrees>>& parts,
                       const Model& of_all, Work& work) {
  std::vector<Model> models;
  std::vector<std::span<const int>> held_out;
  for (std::size_t f = 0; setting.training.options.intervals && f < setting.folds.size(); ++f) {
    models.push_back(assemble(parts, f, setting.plan.max_threads, work));
    held_out.emplace_back(setting.folds[f].held_out.rows);
  }
  const Table& table = *setting.training.table;
  const KeptRows& kept = *setting.training.kept;
  return held_out_intervals(std::move(models), of_all,
                            {table.inputs, table.outputs, kept.precisions, copies_of(kept), std::move(held_out)},
                            setting.plan.max_threads);
}

}  // namespace

ReadableResult fit_readable(const PreparedFit& prepared, const FitSummary& fitted, const ReadableOptions& asked,
                            const Progress& progress) {
  check(prepared.rows().training->options, fitted, asked);
  Work work(progress);
  const std::shared_ptr<const Training> training = with_terms(prepared.rows().training, LocalTerms::linear, work);
  const FitOptions& options = training->options;
  std::vector<FoldRows> folds;
  for (const FoldRows& fold : training->folds) {
    folds.push_back({fold.training, subsample(fold.held_out, most_held_out_rows)});
  }
  const Setting setting{.training = *training,
                        .folds = folds,
                        .plan = {.growth = {.min_leaf_samples = options.min_leaf_samples,
                                            .max_leaves = options.max_leaves,
                                            .search = options.expert.search},
                                 .max_threads = options.max_threads}};
  std::vector<std::unique_ptr<ReadableTrees>> parts;
  const double share = work.left();
  for (const PartitionSummary& partition : fitted.partitions) {
    Work part(work, share / static_cast<double>(fitted.partitions.size()));
    parts.push_back(find_trees(setting, partition, asked, part));
  }
  ReadableResult result{
      .model = assemble(parts, folds.size(), options.max_threads, work), .partitions = {}, .intervals = {}};
  result.intervals = intervals_of(setting, parts, result.model, work);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    result.partitions.push_back(describe(result.model, p, parts[p]->choice));
  }
  if (const PreparedRows& rows = prepared.rows(); rows.has_positions()) {
    result.model = with_codes(result.model, rows.codes.codes, rows.empty_levels);
    result.intervals = with_codes(result.intervals, rows.codes.codes, rows.empty_levels);
  }
  result.model = named(result.model, prepared.data());
  work.finish();
  return result;
}

std::string why_not_readable(const FitOptions& options) {
  constexpr const char* by_crisp = "it is measured by the best crisp tree";
  if (options.folds.count == 0) return "folds.count 0: the tree is chosen by its error on held-out rows";
  if (options.validity == ValidityChoice::blend || options.validity == ValidityChoice::gaussian) {
    return fmt::format("validity blend or gaussian: {}", by_crisp);
  }
  if (rule_of(options.rule).overlapping == ValidityKind::gaussian) {
    std::vector<std::string_view> names;
    for (const Rule& rule : rule_table()) {
      if (rule.overlapping == ValidityKind::gaussian) names.push_back(rule.name);
    }
    return fmt::format("rule {}: {}", fmt::join(names, " or "), by_crisp);
  }
  return "";
}

}  // namespace llmt
