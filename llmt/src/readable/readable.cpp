#include "llmt/readable.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <tuple>

#include "base/parallel.hpp"
#include "data/fold_rows.hpp"
#include "data/regressors.hpp"
#include "estimation/leaf_statistics.hpp"
#include "fit/code_choice.hpp"
#include "fit/error_weights.hpp"
#include "fit/missing_weights.hpp"
#include "fit/robust_weights.hpp"
#include "growth/rules/rule.hpp"
#include "llmt/size.hpp"
#include "llmt/statistics.hpp"
#include "model/codes.hpp"
#include "model/incomplete.hpp"
#include "readable/input_walk.hpp"

namespace llmt {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Held-out errors below this part of that of a constant are rounding.
constexpr double rounding_error = 1e-8;

// Held-out rows of a fold that are looked at, as in the fit.
constexpr Eigen::Index most_held_out_rows = 10000;

// The smallest held-out error of a crisp tree of the fit; infinity if there was none.
double best_crisp_of(const PartitionSummary& partition) {
  double best = infinity;
  for (const CandidateError& error : partition.best_of_kind) {
    if (error.candidate.validity.kind == ValidityKind::crisp) best = std::min(best, error.rmse);
  }
  return best;
}

void check(const FitOptions& options, const FitSummary& fitted, double loss) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument("llmt::fit_readable: " + what); };
  if (!(loss >= 0.0 && std::isfinite(loss))) {
    refuse(fmt::format("loss is {}, it must be a finite number, 0 or more", loss));
  }
  if (const std::string why = why_not_readable(options); !why.empty())
    refuse("a readable tree does not go with " + why);
  if (fitted.partitions.empty() || fitted.partitions.front().cv_folds == 0) {
    refuse("no row was held out in the fit, and the tree is chosen by its error on held-out rows");
  }
}

// Everything but the loss.
struct Setting {
  const Table& table;  // as measured
  const TrainingRows& all;
  const std::vector<FoldRows>& folds;
  TreePlan plan;
  bool intervals;
  int max_threads;
};

std::vector<Sample> samples_of(const Setting& setting, const std::vector<int>& served) {
  const Eigen::VectorXd weights = error_weights(setting.table, served);
  // The last one is that of all rows.
  std::vector<Sample> samples(setting.folds.size() + 1);
  parallel_for(std::ssize(samples), setting.max_threads, [&](Eigen::Index f) {
    const bool is_fold = f < std::ssize(setting.folds);
    const TrainingRows* held_out = is_fold ? &setting.folds[f].held_out : nullptr;
    samples[f] = make_sample(is_fold ? setting.folds[f].training : setting.all, held_out, served, weights);
  });
  return samples;
}

// The held-out errors of one tree.
struct HeldOut {
  double rmse = 0.0;
  Eigen::VectorXd of_folds;
};

HeldOut errors_of(const std::vector<std::vector<WalkStep>>& walks, const std::vector<double>& weights,
                  const TreeKey& key) {
  HeldOut errors{.rmse = 0.0, .of_folds = Eigen::VectorXd(std::ssize(weights))};
  for (std::size_t f = 0; f < weights.size(); ++f) {
    const double sum = walks[f][key.step].trees[key.form][key.price].held_out_error;
    errors.of_folds(f) = std::sqrt(sum / weights[f]);
    errors.rmse += sum;
  }
  errors.rmse = std::sqrt(errors.rmse / std::accumulate(weights.begin(), weights.end(), 0.0));
  return errors;
}

// The smallest tree that is good enough, and how good it is.
struct Choice {
  TreeKey key;
  HeldOut errors;
  double best_crisp = infinity;
  bool is_within_loss = true;
};

Choice choose(const std::vector<std::vector<WalkStep>>& walks, const std::vector<double>& weights, double best_crisp,
              double loss) {
  const std::vector<WalkStep>& final_walk = walks.back();
  std::vector<std::pair<TreeKey, HeldOut>> trees;
  Choice choice{.key = {}, .errors = {}, .best_crisp = best_crisp, .is_within_loss = true};
  for (TreeKey key; key.step < final_walk.size(); ++key.step) {
    for (key.form = 0; key.form < final_walk[key.step].trees.size(); ++key.form) {
      for (key.price = 0; key.price < final_walk[key.step].trees[key.form].size(); ++key.price) {
        trees.emplace_back(key, errors_of(walks, weights, key));
        // Products are there to make trees smaller, not to ask more of them.
        if (!forms()[key.form].products) choice.best_crisp = std::min(choice.best_crisp, trees.back().second.rmse);
      }
    }
  }
  // A tree of a constant is among them: the first of all prices is the variance.
  const double least = rounding_error * trees.front().second.rmse;
  const double most = (1.0 + loss) * std::max(choice.best_crisp, least);
  const auto size_of = [&](const TreeKey& key) { return final_walk[key.step].trees[key.form][key.price].size; };
  const std::pair<TreeKey, HeldOut>* best = nullptr;
  for (const auto& tree : trees) {
    if (!(tree.second.rmse <= most)) continue;
    const auto rank = [&](const std::pair<TreeKey, HeldOut>& each) {
      return std::tuple(size_of(each.first), each.first.form, each.second.rmse);
    };
    if (best == nullptr || rank(tree) < rank(*best)) best = &tree;
  }
  if (best == nullptr) {
    choice.is_within_loss = false;
    best = &*std::ranges::min_element(trees, {}, [](const auto& tree) { return tree.second.rmse; });
  }
  choice.key = best->first;
  choice.errors = best->second;
  return choice;
}

// The chosen tree of one fold, or of all rows.
struct ChosenTree {
  EquationTree tree;
  std::vector<int> pruned;
};

// What is made of one partition: the chosen trees of the folds and, last, of all rows.
struct ReadableTrees {
  std::vector<Sample> samples;
  std::vector<std::optional<ChosenTree>> trees;
  Choice choice;
};

std::unique_ptr<ReadableTrees> find_trees(const Setting& setting, const std::vector<int>& served, double best_crisp,
                                          double loss, Work& work) {
  auto made = std::make_unique<ReadableTrees>();
  made->samples = samples_of(setting, served);
  const Eigen::Index count = std::ssize(made->samples);
  std::vector<std::vector<WalkStep>> walks(count);
  constexpr double share_of_walks = 0.9;
  parallel_for(count, setting.max_threads, [&](Eigen::Index f) {
    Work walk(work, share_of_walks / static_cast<double>(count));
    walks[f] = walk_inputs(made->samples[f], setting.plan, walk);
  });
  std::vector<double> weights;
  for (const FoldRows& fold : setting.folds) {
    weights.push_back(total_weight(fold.held_out) * static_cast<double>(served.size()));
  }
  made->choice = choose(walks, weights, best_crisp, loss);
  const TreeKey& key = made->choice.key;
  made->trees.resize(count);
  parallel_for(count, setting.max_threads, [&](Eigen::Index f) {
    if (!setting.intervals && f + 1 < count) return;
    EquationTree tree = make_tree(made->samples[f], setting.plan, walks[f][key.step], forms()[key.form]);
    std::vector<int> pruned = tree.pruned(price_of(tree, key.price));
    made->trees[f].emplace(ChosenTree{std::move(tree), std::move(pruned)});
    work.check();
  });
  return made;
}

// The model of one fold, or of all rows, with a partition from each of `parts`.
Model assemble(const std::vector<std::unique_ptr<ReadableTrees>>& parts, std::size_t at, int max_threads) {
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
    describe_leaves(described, partition, true, max_threads);
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
  result.rmse = choice.errors.rmse;
  result.fold_rmse = choice.errors.of_folds;
  result.spread = spread_of(choice.errors.of_folds);
  result.best_crisp = choice.best_crisp;
  result.is_within_loss = choice.is_within_loss;
  return result;
}

Intervals intervals_of(const Setting& setting, const std::vector<std::unique_ptr<ReadableTrees>>& parts) {
  std::vector<Model> models;
  std::vector<std::span<const int>> held_out;
  for (std::size_t f = 0; setting.intervals && f < setting.folds.size(); ++f) {
    models.push_back(assemble(parts, f, setting.max_threads));
    held_out.emplace_back(setting.folds[f].held_out.rows);
  }
  const Table& table = setting.table;
  return held_out_intervals(std::move(models), table.inputs, table.outputs, held_out, setting.max_threads);
}

ReadableResult fit_inputs(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                          const Eigen::Ref<const Eigen::MatrixXd>& outputs, const FitOptions& options,
                          const FitSummary& fitted, double loss) {
  Work work(options.progress);
  FitOptions linear = options;
  linear.terms = LocalTerms::linear;
  if (fitted.loss_weights.size() > 0) {
    linear.weights = without_outliers(options.weights, fitted.loss_weights);
  }
  const FitData data(inputs, outputs, linear, true);
  const Table& table = data.table();
  Table weighted = data.trained(fitted.loss_weights);
  if (table.inputs.hasNaN())
    weighted.weights = weighted.weights.cwiseProduct(weights_by_missing(weighted, linear, work));
  std::vector<int> rows(table.inputs.rows());
  std::iota(rows.begin(), rows.end(), 0);
  const TrainingRows all = training_rows(weighted, std::move(rows), options.max_threads);
  std::vector<FoldRows> folds = deal(weighted, table, data.folds(), options.max_threads);
  for (FoldRows& fold : folds) fold.held_out = subsample(fold.held_out, most_held_out_rows);
  const Setting setting{.table = table,
                        .all = all,
                        .folds = folds,
                        .plan = {.growth = {.min_leaf_samples = options.min_leaf_samples,
                                            .max_leaves = options.max_leaves,
                                            .search = options.expert.search},
                                 .max_threads = options.max_threads},
                        .intervals = options.intervals,
                        .max_threads = options.max_threads};
  std::vector<std::unique_ptr<ReadableTrees>> parts;
  const double share = work.left();
  for (const PartitionSummary& partition : fitted.partitions) {
    Work part(work, share / static_cast<double>(fitted.partitions.size()));
    parts.push_back(find_trees(setting, partition.outputs, best_crisp_of(partition), loss, part));
  }
  Model model = assemble(parts, folds.size(), options.max_threads);
  std::vector<ReadablePartition> partitions;
  for (std::size_t p = 0; p < parts.size(); ++p) partitions.push_back(describe(model, p, parts[p]->choice));
  ReadableResult result{std::move(model), std::move(partitions), intervals_of(setting, parts)};
  work.finish();
  return result;
}

}  // namespace

ReadableResult fit_readable(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                            const Eigen::Ref<const Eigen::MatrixXd>& outputs, const FitOptions& options,
                            const FitSummary& fitted, double loss) {
  check(options, fitted, loss);
  const std::vector<std::vector<double>>& codes = fitted.codes.codes;
  if (codes.empty()) return fit_inputs(inputs, outputs, options, fitted, loss);
  ReadableResult result =
      fit_inputs(at_positions(codes, inputs), outputs, with_categories(codes, options), fitted, loss);
  result.model = with_codes(result.model, codes);
  result.intervals = with_codes(result.intervals, codes);
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
  const auto is_set = [](int sign) { return sign != 0; };
  if (std::ranges::any_of(options.monotone, is_set) || std::ranges::any_of(options.slope_signs, is_set)) {
    return "monotone or slope_signs: its equations do not keep them";
  }
  return "";
}

}  // namespace llmt
