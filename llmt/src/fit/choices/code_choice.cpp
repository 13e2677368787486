#include "fit/choices/code_choice.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "fit/choices/lack_of_fit.hpp"
#include "fit/plan/cheap_plan.hpp"
#include "fit/trees/error_weights.hpp"
#include "fit/trees/held_out_error.hpp"
#include "model/codes.hpp"

namespace llmt {
namespace {

using Matrix = Eigen::Ref<const Eigen::MatrixXd>;

// Codes are whole numbers within a range of this length, as those of months, three of them or more.
constexpr double longest_range = 11.0;
constexpr std::size_t fewest_codes = 3;

// A code has at least this many rows.
constexpr Eigen::Index fewest_rows_of_code = 10;

// An input is compared if straight lines in it lack fit at this level, divided by the number of inputs and outputs.
constexpr double significance_of_codes = 0.01;

// The gain of codes has to be beyond chance and at least this part of the error: simple candidates tell no smaller
// gain.
constexpr double smallest_gain_of_codes = 0.02;

// The comparison uses at most 2000 rows (a sample of larger tables), at least 500, and at most 25 000 / coefficients
// rows between these.
constexpr Eigen::Index most_compared_rows = 2000;
constexpr Eigen::Index least_compared_rows = 500;
constexpr Eigen::Index most_compared_numbers = 25000;

// Share of the work that is left for the comparison of a form.
constexpr double share_of_choice = 0.05;

bool may_have_codes(const FitOptions& options) {
  const Rule& rule = rule_of(options.rule);
  const bool is_usual = !rule.has_own_models && rule.overlapping == ValidityKind::blend &&
                        options.validity != ValidityChoice::gaussian && options.max_leaves != 1;
  return is_usual && options.folds.count != 0 && options.split_inputs.empty() && options.regression_inputs.empty() &&
         options.trends.empty();
}

// The codes that a column may have; none if it has other numbers.
std::vector<double> codes_in(const Eigen::Ref<const Eigen::VectorXd>& column, const std::vector<Eigen::Index>& rows) {
  std::map<double, Eigen::Index> rows_of;
  for (const Eigen::Index row : rows) {
    const double value = column(row);
    if (std::isnan(value)) continue;
    if (value != std::floor(value)) return {};
    ++rows_of[value];
    if (rows_of.rbegin()->first - rows_of.begin()->first > longest_range) return {};
  }
  const bool is_often =
      std::ranges::all_of(rows_of, [](const auto& entry) { return entry.second >= fewest_rows_of_code; });
  if (rows_of.size() < fewest_codes || !is_often) return {};
  std::vector<double> codes;
  for (const auto& [code, times] : rows_of) codes.push_back(code + 0.0);  // -0 as 0
  return codes;
}

Codes possible_codes(const GivenRows& given, const std::vector<Eigen::Index>& rows, const FitOptions& options) {
  const Matrix& inputs = given.inputs.values;
  Codes codes(inputs.cols());
  if (!given.may_have_codes || !may_have_codes(options)) return codes;
  for (int j = 0; j < inputs.cols(); ++j) {
    const bool is_number = std::ranges::find(given.categorical, j) == given.categorical.end();
    if (is_number) codes[j] = codes_in(inputs.col(j), rows);
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

// The rows by which forms are compared: all that take part, or of many a sample.
GivenRows some_rows(const GivenRows& given, const std::vector<Eigen::Index>& rows, const Codes& codes) {
  const Matrix& inputs = given.inputs.values;
  Eigen::Index coefficients = 1 + inputs.cols();
  for (const std::vector<double>& of_input : codes) coefficients += std::max<Eigen::Index>(std::ssize(of_input) - 2, 0);
  const Table table{inputs, given.outputs.values, Eigen::VectorXd::Ones(inputs.rows()), {}, {}, {}};
  TrainingRows all;
  all.table = &table;
  all.rows.assign(rows.begin(), rows.end());
  const Eigen::Index count = std::clamp(most_compared_numbers / coefficients, least_compared_rows, most_compared_rows);
  const std::vector<int> some = subsample(all, count).rows;
  return counted_rows_at(given, {some.begin(), some.end()});
}

// The held-out error of every partition with these codes. Empty: there are no two folds, nor that of the caller.
std::vector<CandidateError> errors_of(const std::shared_ptr<const KeptRows>& rows, const Codes& codes,
                                      const std::vector<int>& categorical, const FitOptions& options, Work& work) {
  if (rows->folds.size() < (rows->is_fold_given ? 1 : 2)) return {};
  const bool orders_splits = rule_of(options.rule).splits_on_monotone_inputs;
  const SharedMatrix inputs = shared(at_positions(codes, rows->inputs.values));
  const Training training = make_training(rows, inputs, with_codes(categorical, codes), options, orders_splits);
  const Plan plan = cheap_plan(training);
  std::vector<CandidateError> errors;
  for (const std::vector<int>& served : output_groups(training.outputs(), options.shared_partition)) {
    Work part(work, share_of_choice * work.left());
    errors.push_back(held_out_error(training, plan, served, part).selection.chosen);
  }
  return errors;
}

// The inputs in which straight lines lack fit, the clearest first.
std::vector<int> bent_inputs(const GivenRows& some, const Codes& codes) {
  const Matrix& of_some = some.inputs.values;
  const std::vector<int> inputs = inputs_with(codes);
  std::vector<int> numbers;
  for (int j = 0; j < of_some.cols(); ++j) {
    if (std::ranges::find(some.categorical, j) == some.categorical.end()) numbers.push_back(j);
  }
  const LackOfFit lack(of_some(Eigen::all, numbers), some.outputs.values);
  std::vector<std::pair<double, int>> found;
  for (const int input : inputs) {
    const double p = lack.p_value(of_some.col(input), codes[input]);
    if (p * static_cast<double>(inputs.size()) < significance_of_codes) found.emplace_back(p, input);
  }
  std::ranges::sort(found);
  std::vector<int> result;
  for (const auto& [p, input] : found) result.push_back(input);
  return result;
}

bool is_clearly_better(const CandidateError& simple, const CandidateError& other) {
  return is_beyond_chance(simple, other) && other.rmse < (1.0 - smallest_gain_of_codes) * simple.rmse;
}

}  // namespace

CodeChoice choose_codes(const GivenRows& given, const FitOptions& options, Work& work) {
  CodeChoice result;
  const std::vector<Eigen::Index> counted = counted_rows(given);
  const Codes possible = possible_codes(given, counted, options);
  if (inputs_with(possible).empty()) return result;
  const GivenRows some = some_rows(given, counted, possible);
  const std::vector<int> bent = bent_inputs(some, possible);
  if (bent.empty()) return result;
  const auto rows = std::make_shared<const KeptRows>(keep(some, options.folds));
  Codes chosen(possible.size());
  const std::vector<CandidateError> of_numbers = errors_of(rows, chosen, given.categorical, options, work);
  if (of_numbers.empty()) return result;
  CandidateError least = mean_error(of_numbers, of_numbers);
  result.rmse_as_numbers = least.rmse;
  for (const int input : bent) {
    Codes codes = chosen;
    codes[input] = possible[input];
    const CandidateError errors = mean_error(errors_of(rows, codes, given.categorical, options, work), of_numbers);
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
  for (std::size_t j = 0; j < codes.size(); ++j) {
    if (codes[j].empty()) continue;
    columns[j].codes = codes[j];
    columns[j].levels.resize(codes[j].size() + 1);  // the last for missing values
  }
  return at_positions(columns, inputs);
}

std::vector<int> with_codes(std::vector<int> categorical, const Codes& codes) {
  for (const int input : inputs_with(codes)) categorical.push_back(input);
  return categorical;
}

Intervals with_codes(const Intervals& intervals, const Codes& codes, const std::vector<std::size_t>& empty_levels) {
  std::vector<Model> models;
  for (const Model& model : intervals.models()) models.push_back(with_codes(model, codes, empty_levels));
  return {std::move(models), intervals.parts(), intervals.gaps(), intervals.record()};
}

}  // namespace llmt
