// Fitted trees: every growth rule with every set of options.
#include <stdexcept>

#include "bytes/cases.hpp"
#include "bytes/hash.hpp"
#include "bytes/option_sets.hpp"
#include "llmt/compare.hpp"
#include "llmt/explain.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "llmt/model.hpp"

namespace bytes {
namespace {

// What a model says besides predictions: everything a query can ask for.
std::string answers(const llmt::Model& model, const Eigen::MatrixXd& queries, int threads) {
  Hash hash;
  hash.add(model.leaf_of(queries, threads)).add(model.standard_errors(queries, threads));
  for (const llmt::Extrapolation& point : model.extrapolation(queries, threads)) {
    hash.add(point.distance).add(point.leverage);
  }
  for (Eigen::Index partition = 0; partition < std::ssize(model.partitions()); ++partition) {
    hash.add(model.validities(queries, partition, threads));
    for (const llmt::Leaf& leaf : model.leaves(partition)) hash.add(leaf.low).add(leaf.high).add(leaf.intercept);
  }
  for (const Eigen::Index row : {0, 7, 30}) {
    const Eigen::VectorXd point = queries.row(row);
    hash.add(model.jacobian(point)).add(llmt::attribute(model, point).contributions);
  }
  hash.add(llmt::importance(model, queries.topRows(12), threads)).add(model.prefix(2).predict(queries, threads));
  return hash.text();
}

std::string summary_of(const llmt::FitSummary& summary) {
  Hash hash;
  hash.add(summary.samples).add(summary.missing_values).add(summary.min_leaf_samples).add(summary.quadratic);
  for (const llmt::PartitionSummary& partition : summary.partitions) {
    hash.add(partition.leaves).add(partition.grown_leaves).add(partition.coefficients).add(partition.train_rmse);
    hash.add(partition.rank_deficient_leaves).add(partition.cv_folds).add(partition.held_out_rows);
    hash.add(partition.chosen.rmse).add(partition.chosen.spread).add(partition.chosen.fold_rmse);
    hash.add(partition.crisp_cv_rmse).add(partition.search.largest_excess);
    for (const llmt::CandidateError& other : partition.best_of_kind) hash.add(other.rmse).add(other.fold_rmse);
  }
  return hash.text();
}

std::string fit_and_hash(const Task& task, int threads) {
  llmt::TrainingData data = task.known;
  data.inputs = task.sample.inputs;
  data.outputs = task.sample.outputs;
  const llmt::FitResult result = llmt::fit(data, task.options);
  Eigen::MatrixXd queries = make_queries();
  if (!data.categorical_inputs.empty()) {
    // Levels 0 ... 4, and 5, which no row has.
    for (Eigen::Index row = 0; row < queries.rows(); ++row) queries(row, 2) = static_cast<double>(row % 6);
  }
  Eigen::MatrixXd with_gaps = queries;
  remove_values(with_gaps);
  Hash predictions;
  predictions.add(result.model.predict(queries, threads)).add(result.model.predict(with_gaps, threads));
  std::string text = "model:" + hash_of(llmt::to_json(result.model)) + " predictions:" + predictions.text() +
                     " answers:" + answers(result.model, queries, threads) + " summary:" + summary_of(result.summary);
  if (!result.intervals.empty()) {
    const llmt::Bounds bounds = result.intervals.predict(queries, 0.9, threads);
    text += " intervals:" + Hash().add(bounds.lower).add(bounds.upper).text();
  }
  return text;
}

void add_sets(const std::string& part, const std::vector<OptionSet>& sets, Results& results) {
  for (const GrowthRuleName& rule : growth_rules()) {
    for (const OptionSet& set : sets) {
      add_for_threads(results, part + "/" + rule.name + "/" + set.name, [&](int threads) {
        Task task = make_task(rule.rule, threads);
        set.apply(task);
        return fit_and_hash(task, threads);
      });
    }
  }
}

}  // namespace

void add_for_threads(Results& results, const std::string& name, const std::function<std::string(int)>& make) {
  const auto result = [&](int threads) {
    try {
      return make(threads);
    } catch (const std::invalid_argument&) {
      return std::string("refused");
    }
  };
  if (!results.at_both_counts) {
    const std::size_t turn = results.size();  // before the case is among them
    results[name] = result(turn % 2 == 0 ? 1 : 8);
    return;
  }
  const std::string one = result(1);
  const std::string eight = result(8);
  results[name] = one == eight ? one : one + " BUT WITH 8 THREADS " + eight;
}

void witness_trees(const std::string&, Results& results) { add_sets("trees", option_sets(), results); }

// From 50000 rows on one fold is held out once, candidates are compared on samples, splits are searched by bins, and
// the joint estimate goes from a sample to all rows.
void witness_many_rows(const std::string&, Results& results) {
  for (const bool has_missing : {false, true}) {
    add_for_threads(results, has_missing ? "many_rows/missing" : "many_rows/default", [&](int threads) {
      Task task{make_sample(50000, 5), {}};
      if (has_missing) remove_values(task.sample.inputs);
      task.options.max_leaves = 40;
      task.options.max_threads = threads;
      return fit_and_hash(task, threads);
    });
  }
}

void witness_comparison(const std::string&, Results& results) {
  add_for_threads(results, "comparison/usual_methods", [](int threads) {
    const Task task = make_task(llmt::GrowthRule::rd, threads);
    llmt::CompareOptions options;
    options.folds.count = 2;
    const Sample sample = make_sample(120, 3);
    const llmt::TrainingData data{sample.inputs, sample.outputs};
    const llmt::ComparisonResult found = llmt::compare(data, llmt::usual_methods(task.options, data), options);
    Hash hash;
    hash.add(found.recommended);
    for (const llmt::Comparison& method : found.methods) {
      hash.add(method.leaves).add(method.parameters).add(method.fold_rmse).add(method.cv_rmse).add(method.spread);
      hash.add(method.largest_jump);
    }
    return "figures:" + hash.text();
  });
}

}  // namespace bytes
