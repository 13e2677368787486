#include "llmt/fit.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <vector>

#include "fit/check_options.hpp"
#include "fit/code_choice.hpp"
#include "fit/fit_terms.hpp"
#include "fit/linear_or_quadratic.hpp"
#include "fit/robust_weights.hpp"
#include "llmt/outliers.hpp"
#include "model/codes.hpp"

namespace llmt {
namespace {

// Least squares cannot fit what the rounding of one output's error hides. Rows of weight 0 take no part. What is wrong
// with shapes or numbers is for fit_terms() to say.
void refuse_hidden_outputs(const Eigen::Ref<const Eigen::MatrixXd>& outputs, const Eigen::VectorXd& weights) {
  if (outputs.size() == 0 || !outputs.allFinite() || outputs.cwiseAbs().maxCoeff() > largest_magnitude) return;
  if (weights.size() > 0 && weights.size() != outputs.rows()) return;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < outputs.rows(); ++row) {
    if (weights.size() == 0 || weights(row) > 0.0) rows.push_back(row);
  }
  for (Eigen::Index o = 0; o < outputs.cols() && !rows.empty(); ++o) {
    const Eigen::VectorXd values = outputs.col(o)(rows);
    const HeavyRows heavy = heavy_rows(values);
    if (!heavy.hide_the_others) continue;
    throw std::invalid_argument(fmt::format(
        "llmt::fit: outputs({}, {}) is {}, beside which the other values differ by less than its rounding error; "
        "leave that row out, or set loss to tukey",
        rows[heavy.rows.front()], o, values(heavy.rows.front())));
  }
}

FitResult fit_by_squares(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                         const Eigen::Ref<const Eigen::MatrixXd>& outputs, const FitOptions& options, Work& work,
                         const Eigen::VectorXd& loss_weights = {}) {
  refuse_hidden_outputs(outputs, options.weights);
  const auto fit_inputs = [&](const Eigen::Ref<const Eigen::MatrixXd>& taken, const FitOptions& with) {
    Work rest(work, work.left());
    return with.terms == LocalTerms::automatic ? fit_linear_or_quadratic(taken, outputs, with, rest, loss_weights)
                                               : fit_terms(taken, outputs, with, rest, loss_weights);
  };
  CodeChoice chosen = choose_codes(inputs, outputs, options, work, loss_weights);
  if (chosen.taken.empty()) {
    FitResult result = fit_inputs(inputs, options);
    result.summary.codes = std::move(chosen);
    return result;
  }
  FitResult result = fit_inputs(at_positions(chosen.codes, inputs), with_categories(chosen.codes, options));
  result.model = with_codes(result.model, chosen.codes);
  result.intervals = with_codes(result.intervals, chosen.codes);
  result.summary.codes = std::move(chosen);
  return result;
}

}  // namespace

FitResult fit(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
              const FitOptions& options) {
  check_options(options, inputs.cols());
  Work work(options.progress);
  if (options.loss == Loss::squared) {
    FitResult result = fit_by_squares(inputs, outputs, options, work);
    work.finish();
    return result;
  }
  constexpr double share_of_loss = 0.2;
  Work preliminary(work, share_of_loss);
  const Eigen::VectorXd weights = robust_weights(inputs, outputs, options, preliminary);
  FitOptions kept = options;
  kept.weights = without_outliers(options.weights, weights);
  FitResult result = fit_by_squares(inputs, outputs, kept, work, weights);
  result.summary.loss_weights = weights;
  work.finish();
  return result;
}

Eigen::VectorXd rmse(const Eigen::Ref<const Eigen::MatrixXd>& predicted,
                     const Eigen::Ref<const Eigen::MatrixXd>& measured) {
  if (predicted.rows() != measured.rows() || predicted.cols() != measured.cols() || predicted.rows() == 0) {
    throw std::invalid_argument(
        fmt::format("llmt::rmse: predicted is {} x {}, measured is {} x {}; the shapes must agree and have rows",
                    predicted.rows(), predicted.cols(), measured.rows(), measured.cols()));
  }
  return ((predicted - measured).colwise().squaredNorm() / static_cast<double>(predicted.rows()))
      .cwiseSqrt()
      .transpose();
}

}  // namespace llmt
