#include "fit/code_choice.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "base/parallel.hpp"
#include "data/fold_rows.hpp"
#include "fit/cheap_plan.hpp"
#include "fit/error_weights.hpp"
#include "fit/grow_tree.hpp"
#include "fit/lack_of_fit.hpp"
#include "llmt/statistics.hpp"
#include "model/codes.hpp"
#include "selection/selection.hpp"

namespace llmt {
namespace {

using Matrix = Eigen::Ref<const Eigen::MatrixXd>;

// Codes are whole numbers within a range of this length, as those of months, three of them or more.
constexpr double longest_range = 11.0;
constexpr std::size_t fewest_codes = 3;

// A code has at least this many rows.
constexpr Eigen::Index fewest_rows = 10;

// An input is compared if straight lines in it lack fit at this level, divided by the number of inputs and outputs.
constexpr double significance_of_codes = 0.01;

// Codes have to be better by more than this many standard errors of the gain, and by this part of the error: simple
// candidates tell no smaller gain.
constexpr double standard_errors_of_codes = 2.0;
constexpr double smallest_gain_of_codes = 0.02;

// Rows that are compared; of more a sample. With many coefficients this many numbers.
constexpr Eigen::Index most_compared_rows = 2000;
constexpr Eigen::Index least_compared_rows = 500;
constexpr Eigen::Index most_compared_numbers = 25000;

// Of the work that is left, for the comparison of a form.
constexpr double share_of_choice = 0.05;

bool may_have_codes(const FitOptions& options) {
  const Rule& rule = rule_of(options.rule);
  const bool is_usual = !rule.has_own_models && rule.overlapping == ValidityKind::blend &&
                        options.validity != ValidityChoice::gaussian && options.max_leaves != 1;
  return options.choose_codes && is_usual && options.folds.count != 0 && options.split_inputs.empty() &&
         options.regression_inputs.empty() && options.slope_signs.empty() && options.monotone.empty();
}

// The codes that a column may have; none if it has other numbers.
std::vector<double> codes_in(const Eigen::Ref<const Eigen::VectorXd>& column, const Eigen::VectorXd& weights) {
  std::map<double, Eigen::Index> rows_of;
  for (Eigen::Index row = 0; row < column.size(); ++row) {
    const double value = column(row);
    if (std::isnan(value) || (weights.size() > 0 && !(weights(row) > 0.0))) continue;
    if (value != std::floor(value)) return {};
    ++rows_of[value];
    if (rows_of.rbegin()->first - rows_of.begin()->first > longest_range) return {};
  }
  const bool is_often = std::ranges::all_of(rows_of, [](const auto& entry) { return entry.second >= fewest_rows; });
  if (rows_of.size() < fewest_codes || !is_often) return {};
  std::vector<double> codes;
  for (const auto& [code, rows] : rows_of) codes.push_back(code + 0.0);  // -0 as 0
  return codes;
}

Codes possible_codes(const Matrix& inputs, const Matrix& outputs, const FitOptions& options) {
  Codes codes(inputs.cols());
  if (!may_have_codes(options) || inputs.rows() != outputs.rows()) return codes;
  if (options.weights.size() > 0 && options.weights.size() != inputs.rows()) return codes;
  for (int j = 0; j < inputs.cols(); ++j) {
    const std::vector<int>& categorical = options.categorical_inputs;
    if (std::ranges::find(categorical, j) == categorical.end()) codes[j] = codes_in(inputs.col(j), options.weights);
  }
  return codes;
}

std::vector<int> inputs_with(const Codes& codes) {
  std::vector<int> inputs;
  for (int j = 0; j < std::ssize(codes); ++j) {
    if (!codes[j].empty()) inputs.push_back(j);
  }
  return inputs;
}

// The held-out errors with some inputs as codes: root mean squares, of all rows and of the folds.
struct HeldOut {
  double rmse = 0.0;
  Eigen::VectorXd of_folds = {};
};

// Rows by which forms are compared: all of positive weight, or of many a sample.
struct ComparedRows {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
  std::vector<double> groups;
  FitOptions options;
  Eigen::VectorXd loss_weights;
};

ComparedRows some_rows(const Matrix& inputs, const Matrix& outputs, const FitOptions& options,
                       const Eigen::VectorXd& loss_weights, const Codes& codes) {
  Eigen::Index coefficients = 1 + inputs.cols();
  for (const std::vector<double>& of_input : codes) coefficients += std::max<Eigen::Index>(std::ssize(of_input) - 2, 0);
  const Table table{inputs, outputs, Eigen::VectorXd::Ones(inputs.rows()), {}, {}, {}};
  TrainingRows all;
  all.table = &table;
  for (int row = 0; row < inputs.rows(); ++row) {
    if (options.weights.size() == 0 || options.weights(row) > 0.0) all.rows.push_back(row);
  }
  const Eigen::Index count = std::clamp(most_compared_numbers / coefficients, least_compared_rows, most_compared_rows);
  const std::vector<int> rows = subsample(all, count).rows;
  ComparedRows some{inputs(rows, Eigen::all), outputs(rows, Eigen::all), {}, options, {}};
  if (options.weights.size() > 0) some.options.weights = options.weights(rows);
  if (loss_weights.size() > 0) some.loss_weights = loss_weights(rows);
  if (!options.folds.groups.empty()) {
    for (const int row : rows) some.groups.push_back(options.folds.groups[row]);
    some.options.folds.groups = some.groups;
  }
  if (options.terms == LocalTerms::automatic) some.options.terms = LocalTerms::linear;
  return some;
}

// The held-out errors with these codes, one entry a partition. Empty: there are no two folds.
std::vector<HeldOut> errors_of(const ComparedRows& some, const Codes& codes, Work& work) {
  const Eigen::MatrixXd inputs = at_positions(codes, some.inputs);
  const FitOptions options = with_categories(codes, some.options);
  const FitData data(inputs, some.outputs, options, rule_of(options.rule).splits_on_monotone_inputs);
  std::vector<int> rows(data.table().inputs.rows());
  std::iota(rows.begin(), rows.end(), 0);
  const Table weighted = data.trained(some.loss_weights);
  const TrainingRows all = training_rows(weighted, std::move(rows), options.max_threads);
  const std::vector<FoldRows> folds = deal(weighted, data.table(), data.folds(), options.max_threads);
  if (folds.size() < 2) return {};
  const Plan plan = cheap_plan(options, all, std::ssize(folds));
  std::vector<HeldOut> errors;
  for (const std::vector<int>& served : output_groups(some.outputs.cols(), options.shared_partition)) {
    Work part(work, share_of_choice * work.left());
    Work choosing(part, 0.5);
    std::vector<GrownTree> trees(folds.size());
    parallel_for(std::ssize(folds), options.max_threads, [&](Eigen::Index f) {
      Work tree(part, 0.5 / static_cast<double>(folds.size()));
      trees[f] = grow_tree(folds[f].training, served, plan, false, options.max_threads, tree).tree;
    });
    const CandidateError chosen =
        select(folds, trees, plan.candidates, error_weights(data.table(), served), options.max_threads, choosing)
            .chosen;
    errors.push_back({chosen.rmse, chosen.fold_rmse});
  }
  return errors;
}

// The errors of all partitions as one; of several, each in parts of that of numbers.
HeldOut mean_of(const std::vector<HeldOut>& errors, const std::vector<HeldOut>& of_numbers) {
  HeldOut mean{0.0, Eigen::VectorXd::Zero(errors.front().of_folds.size())};
  const auto partitions = static_cast<double>(errors.size());
  for (std::size_t p = 0; p < errors.size(); ++p) {
    const double unit = errors.size() > 1 && of_numbers[p].rmse > 0.0 ? of_numbers[p].rmse : 1.0;
    mean.rmse += errors[p].rmse / unit / partitions;
    mean.of_folds += errors[p].of_folds / (unit * partitions);
  }
  return mean;
}

// The inputs in which straight lines lack fit, the clearest first.
std::vector<int> bent_inputs(const ComparedRows& some, const Codes& codes) {
  const std::vector<int> inputs = inputs_with(codes);
  std::vector<int> numbers;
  for (int j = 0; j < some.inputs.cols(); ++j) {
    const std::vector<int>& categorical = some.options.categorical_inputs;
    if (std::ranges::find(categorical, j) == categorical.end()) numbers.push_back(j);
  }
  const LackOfFit lack(some.inputs(Eigen::all, numbers), some.outputs);
  std::vector<std::pair<double, int>> found;
  for (const int input : inputs) {
    const double p = lack.p_value(some.inputs.col(input), codes[input]);
    if (p * static_cast<double>(inputs.size()) < significance_of_codes) found.emplace_back(p, input);
  }
  std::ranges::sort(found);
  std::vector<int> result;
  for (const auto& [p, input] : found) result.push_back(input);
  return result;
}

bool is_clearly_better(const HeldOut& simple, const HeldOut& other) {
  const PairedDifference gain = paired_difference(simple.of_folds, other.of_folds);
  return gain.mean > standard_errors_of_codes * gain.standard_error &&
         other.rmse < (1.0 - smallest_gain_of_codes) * simple.rmse;
}

}  // namespace

CodeChoice choose_codes(const Matrix& inputs, const Matrix& outputs, const FitOptions& options, Work& work,
                        const Eigen::VectorXd& loss_weights) {
  CodeChoice result;
  const Codes possible = possible_codes(inputs, outputs, options);
  if (inputs_with(possible).empty()) return result;
  const ComparedRows some = some_rows(inputs, outputs, options, loss_weights, possible);
  const std::vector<int> bent = bent_inputs(some, possible);
  if (bent.empty()) return result;
  Codes chosen(inputs.cols());
  const std::vector<HeldOut> of_numbers = errors_of(some, chosen, work);
  if (of_numbers.empty()) return result;
  HeldOut least = mean_of(of_numbers, of_numbers);
  result.rmse_as_numbers = least.rmse;
  for (const int input : bent) {
    Codes codes = chosen;
    codes[input] = possible[input];
    const HeldOut errors = mean_of(errors_of(some, codes, work), of_numbers);
    result.compared.push_back(input);
    if (!is_clearly_better(least, errors)) break;
    least = errors;
    chosen = std::move(codes);
  }
  std::ranges::sort(result.compared);
  result.rmse_as_codes = least.rmse;
  result.taken = inputs_with(chosen);
  if (!result.taken.empty()) result.codes = std::move(chosen);
  return result;
}

Eigen::MatrixXd at_positions(const Codes& codes, const Matrix& inputs) {
  std::vector<InputColumn> columns(codes.size());
  for (std::size_t j = 0; j < codes.size(); ++j) columns[j].codes = codes[j];
  return at_positions(columns, inputs);
}

FitOptions with_categories(const Codes& codes, FitOptions options) {
  for (const int input : inputs_with(codes)) options.categorical_inputs.push_back(input);
  return options;
}

Intervals with_codes(const Intervals& intervals, const Codes& codes) {
  std::vector<Model> models;
  for (const Model& model : intervals.models()) models.push_back(with_codes(model, codes));
  return {std::move(models), intervals.residuals(), intervals.incomplete_residuals()};
}

}  // namespace llmt
