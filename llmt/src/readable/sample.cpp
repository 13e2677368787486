#include "readable/sample.hpp"

#include <algorithm>
#include <cmath>

#include "llmt/options.hpp"
#include "partition/local_models.hpp"
#include "readable/decimal.hpp"

namespace llmt {
namespace {

// Centres are rounded to a power of ten that is at most this part of the input's scale.
constexpr double centre_grain = 0.1;

RowValues values_of(const TrainingRows& rows, const Sample& sample) {
  const Eigen::Index count = rows.count();
  const Table& table = *rows.table;
  const TrainingRows& described = sample.described;
  RowValues values{.inputs = RowMajor(count, table.inputs.cols()),
                   .deviations = RowMajor(count, std::ssize(described.regressors)),
                   .outputs = RowMajor(count, std::ssize(sample.outputs)),
                   .weights = Eigen::VectorXd(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const int row = rows.rows[i];
    values.inputs.row(i) = table.inputs.row(row);
    for (Eigen::Index o = 0; o < values.outputs.cols(); ++o)
      values.outputs(i, o) = table.outputs(row, sample.outputs[o]);
    values.weights(i) = rows.weight_unit * table.weights(row);
    deviations_at(described.columns, described.regressors, values.inputs.row(i).data(),
                  values.deviations.row(i).data());
  }
  values.deviations = values.deviations.array().isNaN().select(0.0, values.deviations);
  return values;
}

Eigen::VectorXd scales_of(const TrainingRows& rows) {
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(std::ssize(rows.columns));
  for (Eigen::Index j = 0; j < scale.size(); ++j) {
    const InputColumn& column = rows.columns[j];
    const double range = column.high - column.low;
    if (!(range > 0.0) || column.is_categorical()) continue;
    const auto add = [&](RowSpan block, WeightedMean& squares) {
      for (Eigen::Index i = block.begin; i < block.end; ++i) {
        const double part = (rows.table->inputs(rows.rows[i], j) - column.centre) / range;
        if (!std::isnan(part)) squares.add(part * part, rows.table->weights(rows.rows[i]));
      }
    };
    const double square = sum_over(RowBlocks{rows.count()}, 1, WeightedMean{}, add).value();
    if (square > 0.0) scale(j) = range * std::sqrt(square);
  }
  return scale;
}

// Rounds the centres of numbers and leaves products out.
void round_centres(const Eigen::VectorXd& scale, TrainingRows& rows) {
  for (std::size_t j = 0; j < rows.columns.size(); ++j) {
    InputColumn& column = rows.columns[j];
    if (column.is_categorical() || !(column.high > column.low)) continue;
    const double centre = rounded(column.centre, exponent_below(centre_grain * scale(j)));
    if (centre >= column.low && centre <= column.high) column.centre = centre;
  }
  std::erase_if(rows.regressors, [](const Regressor& regressor) { return regressor.second_input >= 0; });
  for (Regressor& regressor : rows.regressors) {
    if (regressor.level < 0) regressor.centre = rows.columns[regressor.input].centre;
  }
}

}  // namespace

Sample make_sample(const TrainingRows& training, const TrainingRows* held_out, const std::vector<int>& outputs,
                   const Eigen::VectorXd& output_weights) {
  Sample sample{.described = training,
                .outputs = outputs,
                .output_weights = output_weights,
                .input_scale = scales_of(training),
                .training = {},
                .held_out = {}};
  round_centres(sample.input_scale, sample.described);
  sample.training = values_of(training, sample);
  if (held_out != nullptr) sample.held_out = values_of(*held_out, sample);
  return sample;
}

std::vector<Term> terms_of(const Sample& sample, const std::vector<int>& inputs, bool products) {
  const std::vector<Regressor>& regressors = sample.described.regressors;
  std::vector<Term> terms;
  std::vector<int> numbers;
  for (int k = 0; k < static_cast<int>(regressors.size()); ++k) {
    if (std::ranges::find(inputs, regressors[k].input) == inputs.end()) continue;
    terms.push_back({k});
    const InputColumn& input = sample.described.columns[regressors[k].input];
    const bool has_squares = std::max(std::abs(input.low), std::abs(input.high)) <= largest_factor;
    if (regressors[k].level < 0 && input.high > input.low && has_squares) numbers.push_back(k);
  }
  for (std::size_t i = 0; products && i < numbers.size(); ++i) {
    for (std::size_t j = i; j < numbers.size(); ++j) terms.push_back({numbers[i], numbers[j]});
  }
  return terms;
}

std::vector<Parents> parents_of(const std::vector<Term>& terms) {
  std::vector<Parents> parents(terms.size(), {-1, -1});
  const auto main_of = [&](int regressor) -> Eigen::Index {
    const auto is_main = [&](const Term& term) { return term.second < 0 && term.first == regressor; };
    return std::ranges::find_if(terms, is_main) - terms.begin();
  };
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (terms[t].second >= 0) parents[t] = {main_of(terms[t].first), main_of(terms[t].second)};
  }
  return parents;
}

Eigen::Index size_of_term(const Sample& sample, const Term& term) {
  const auto factor = [&](int k) -> Eigen::Index {
    return sample.described.columns[sample.described.regressors[k].input].centre == 0.0 ? 1 : 3;
  };
  if (term.second < 0) return sample.described.regressors[term.first].level < 0 ? 4 : 6;
  return 3 + factor(term.first) + (term.second == term.first ? 2 : 1 + factor(term.second));
}

}  // namespace llmt
