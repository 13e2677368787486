#include "fit/term_choice.hpp"

#include <algorithm>

#include "data/regressors.hpp"
#include "fit/trees/held_out_error.hpp"

namespace llmt {
namespace {

std::vector<CandidateError> errors_of(const FitResult& fitted) {
  std::vector<CandidateError> errors;
  for (const PartitionSummary& partition : fitted.summary.partitions) errors.push_back(partition.chosen);
  return errors;
}

}  // namespace

std::vector<std::pair<LocalTerms, double>> terms_to_compare(const PreparedRows& rows) {
  if (rows.terms != LocalTerms::automatic) return {{rows.terms, 1.0}};
  const Training& training = *rows.training;
  const Eigen::Ref<const Eigen::MatrixXd>& inputs = training.inputs.values;
  const Eigen::Index numbers = count_numeric_inputs(inputs.cols(), training.categorical, training.options);
  const bool both = numbers > 0 && numbers <= most_inputs_of_products && !training.folds.empty() &&
                    !(inputs.array().abs() > largest_factor).any();
  if (!both) return {{LocalTerms::linear, 1.0}};
  // Work goes with the coefficients of a local model: n + 1, and (n + 1) (n + 2) / 2.
  const double linear = 2.0 / static_cast<double>(numbers + 4);
  return {{LocalTerms::linear, linear}, {LocalTerms::quadratic, 1.0 - linear}};
}

FitResult better_of(std::vector<FitResult> fits) {
  if (fits.size() == 1) return std::move(fits.front());
  const std::vector<CandidateError> linear = errors_of(fits.front());
  const std::vector<CandidateError> quadratic = errors_of(fits.back());
  const CandidateError of_linear = mean_error(linear, linear);
  const CandidateError of_quadratic = mean_error(quadratic, linear);
  const std::vector<PartitionSummary>& trees = fits.front().summary.partitions;
  const bool least_squares = std::ranges::all_of(trees, [](const PartitionSummary& tree) { return tree.leaves == 1; });
  const bool is_better = least_squares ? is_beyond_chance(of_linear, of_quadratic) : of_quadratic.rmse < of_linear.rmse;
  FitResult& taken = is_better ? fits.back() : fits.front();
  taken.summary.other_terms = is_better ? linear : quadratic;
  return std::move(taken);
}

}  // namespace llmt
