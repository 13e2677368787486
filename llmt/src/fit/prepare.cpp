#include "fit/prepare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "fit/check_options.hpp"
#include "fit/code_choice.hpp"
#include "fit/missing_weights.hpp"
#include "fit/robust_weights.hpp"
#include "growth/rules/rule.hpp"
#include "llmt/fit.hpp"
#include "llmt/outliers.hpp"

namespace llmt {
namespace {

// Of the work of a fit with the robust loss.
constexpr double share_of_loss = 0.2;

// Least squares cannot fit what the rounding of one output's error hides. Rows of weight 0 take no part.
void refuse_hidden_outputs(const GivenRows& given) {
  const Eigen::Ref<const Eigen::MatrixXd>& outputs = given.outputs.values;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < outputs.rows(); ++row) {
    if (given.weights.size() == 0 || given.weights(row) > 0.0) rows.push_back(row);
  }
  for (Eigen::Index o = 0; o < outputs.cols(); ++o) {
    const Eigen::VectorXd values = outputs.col(o)(rows);
    const HeavyRows heavy = heavy_rows(values);
    if (!heavy.hide_the_others) continue;
    throw std::invalid_argument(fmt::format(
        "llmt::fit: outputs({}, {}) is {}, beside which the other values differ by less than its rounding error; "
        "leave that row out, or set loss to tukey",
        rows[heavy.rows.front()], o, values(heavy.rows.front())));
  }
}

std::shared_ptr<const Training> described(std::shared_ptr<const KeptRows> kept, const SharedMatrix& inputs,
                                          std::vector<int> categorical, const FitOptions& options, Work& work) {
  const auto by_missing = [&](const TrainingRows& all) { return weights_by_missing(all, options, work); };
  const bool orders_splits = rule_of(options.rule).splits_on_monotone_inputs;
  return std::make_shared<const Training>(
      make_training(std::move(kept), inputs, std::move(categorical), options, orders_splits, by_missing));
}

// The inputs whose values are categories, ascending.
std::vector<int> categorical_of(const TrainingData& data) {
  if (!data.levels.empty() && std::ssize(data.levels) != data.inputs.cols()) {
    throw std::invalid_argument(
        fmt::format("llmt::fit: levels has {} entries, there are {} inputs", data.levels.size(), data.inputs.cols()));
  }
  std::vector<int> categorical = data.categorical_inputs;
  for (int j = 0; j < std::ssize(data.levels); ++j) {
    const auto count = static_cast<double>(data.levels[j].size());
    if (count == 0.0) continue;
    if (std::ranges::find(categorical, j) == categorical.end()) categorical.push_back(j);
    for (const double value : data.inputs.col(j)) {
      if (!(value >= count)) continue;
      throw std::invalid_argument(fmt::format(
          "llmt::fit: a category of input {} is {}, it must be below the number of its levels, {}", j, value, count));
    }
  }
  return categorical;
}

}  // namespace

GivenRows given_rows(const TrainingData& data) {
  return {.inputs = {data.inputs},
          .outputs = {data.outputs},
          .weights = data.weights,
          .groups = data.groups,
          .categorical = categorical_of(data)};
}

Model named(const Model& model, const TrainingData& data) {
  if (data.input_names.empty() && data.output_names.empty() && data.levels.empty()) return model;
  std::vector<std::string> inputs = data.input_names;
  std::vector<std::string> outputs = data.output_names;
  for (std::size_t j = 0; j < model.inputs().size() && data.input_names.empty(); ++j) {
    inputs.push_back(model.inputs()[j].name);
  }
  for (std::size_t o = 0; o < model.outputs().size() && data.output_names.empty(); ++o) {
    outputs.push_back(model.outputs()[o].name);
  }
  return model.named(inputs, outputs, data.levels);
}

PreparedRows prepare(const GivenRows& all, const FitOptions& options, Work& work) {
  check_options(options, all.inputs.values.cols());
  GivenRows given = checked(all, options);
  if (options.loss == Loss::tukey) {
    Work weighting(work, share_of_loss);
    given.loss_weights = robust_weights(given, options, weighting);
    given.weights = without_outliers(given.weights, given.loss_weights);
  }
  refuse_hidden_outputs(given);
  FitOptions of_columns = options;
  of_columns.progress = {};
  if (options.terms == LocalTerms::automatic) of_columns.terms = LocalTerms::linear;
  CodeChoice codes = choose_codes(given, of_columns, work);
  const auto kept = std::make_shared<const KeptRows>(keep(given, options.folds));
  const bool has_codes = !codes.taken.empty();
  const SharedMatrix columns = has_codes ? shared(at_positions(codes.codes, kept->inputs.values)) : kept->inputs;
  std::vector<int> categorical = with_codes(given.categorical, codes.codes);
  return {described(kept, columns, std::move(categorical), of_columns, work), options.terms, std::move(codes),
          std::move(given.loss_weights)};
}

PreparedRows prepare_plain(const GivenRows& given, const FitOptions& options, Work& work) {
  const auto kept = std::make_shared<const KeptRows>(keep(given, options.folds));
  return {described(kept, kept->inputs, given.categorical, options, work), options.terms};
}

std::shared_ptr<const Training> with_terms(const std::shared_ptr<const Training>& training, LocalTerms terms,
                                           Work& work) {
  if (training->options.terms == terms) return training;
  FitOptions options = training->options;
  options.terms = terms;
  return described(training->kept, training->inputs, training->categorical, options, work);
}

struct PreparedFit::Parts {
  std::shared_ptr<const TrainingData> data;
  PreparedRows rows;  // view the data
};

PreparedFit::PreparedFit(TrainingData data, const FitOptions& options, const Progress& progress)
    : PreparedFit(std::make_shared<const TrainingData>(std::move(data)), options, progress) {}

PreparedFit::PreparedFit(std::shared_ptr<const TrainingData> data, const FitOptions& options,
                         const Progress& progress) {
  Work work(progress);
  PreparedRows rows = prepare(given_rows(*data), options, work);
  parts_ = std::make_shared<const Parts>(Parts{std::move(data), std::move(rows)});
  work.finish();
}

const TrainingData& PreparedFit::data() const { return *parts_->data; }

const PreparedRows& PreparedFit::rows() const { return parts_->rows; }

}  // namespace llmt
