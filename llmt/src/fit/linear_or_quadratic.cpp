#include "fit/linear_or_quadratic.hpp"

#include <algorithm>

#include "data/regressors.hpp"
#include "fit/fit_terms.hpp"
#include "selection/selection.hpp"

namespace llmt {

namespace {

// The errors of all partitions as one, each in parts of what the linear models leave of it.
CandidateError mean_error(const FitSummary& of, const FitSummary& linear) {
  CandidateError mean{.candidate = {}, .fold_rmse = Eigen::VectorXd::Zero(linear.partitions[0].cv_folds)};
  const double partitions = static_cast<double>(linear.partitions.size());
  for (std::size_t p = 0; p < linear.partitions.size(); ++p) {
    const double unit = linear.partitions[p].chosen.rmse > 0.0 ? linear.partitions[p].chosen.rmse : 1.0;
    mean.rmse += of.partitions[p].chosen.rmse / unit / partitions;
    mean.fold_rmse += of.partitions[p].chosen.fold_rmse / (unit * partitions);
  }
  return mean;
}

}  // namespace

FitResult fit_linear_or_quadratic(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                  const Eigen::Ref<const Eigen::MatrixXd>& outputs, const FitOptions& options,
                                  Work& work, const Eigen::VectorXd& loss_weights) {
  const Eigen::Index numbers = count_numeric_inputs(inputs.cols(), options);
  const bool both = numbers > 0 && numbers <= most_inputs_of_products && options.folds.count != 0 &&
                    !(inputs.array().abs() > largest_factor).any();
  FitOptions with_terms = options;
  const auto fit_with = [&](LocalTerms terms, double share) {
    with_terms.terms = terms;
    Work part(work, share);
    return fit_terms(inputs, outputs, with_terms, part, loss_weights);
  };
  // Work goes with the coefficients of a local model: n + 1, and (n + 1) (n + 2) / 2.
  FitResult linear = fit_with(LocalTerms::linear, both ? 2.0 / static_cast<double>(numbers + 4) : 1.0);
  if (!both || linear.summary.partitions.front().cv_folds == 0) return linear;
  FitResult quadratic = fit_with(LocalTerms::quadratic, 1.0);
  const CandidateError of_linear = mean_error(linear.summary, linear.summary);
  const CandidateError of_quadratic = mean_error(quadratic.summary, linear.summary);
  const std::vector<PartitionSummary>& trees = linear.summary.partitions;
  const bool least_squares = std::ranges::all_of(trees, [](const PartitionSummary& tree) { return tree.leaves == 1; });
  const bool is_better = least_squares ? is_beyond_chance(of_linear, of_quadratic) : of_quadratic.rmse < of_linear.rmse;
  FitResult& taken = is_better ? quadratic : linear;
  for (const PartitionSummary& partition : (is_better ? linear : quadratic).summary.partitions) {
    taken.summary.other_terms.push_back(partition.chosen);
  }
  return std::move(taken);
}

}  // namespace llmt
