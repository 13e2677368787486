#include "llmt/fit.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <vector>

#include "fit/check_options.hpp"
#include "fit/fit_terms.hpp"
#include "fit/linear_or_quadratic.hpp"
#include "fit/robust_weights.hpp"
#include "llmt/outliers.hpp"

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
                         const Eigen::Ref<const Eigen::MatrixXd>& outputs, const FitOptions& options) {
  refuse_hidden_outputs(outputs, options.weights);
  if (options.terms == LocalTerms::automatic) return fit_linear_or_quadratic(inputs, outputs, options);
  return fit_terms(inputs, outputs, options);
}

}  // namespace

FitResult fit(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
              const FitOptions& options) {
  check_options(options, inputs.cols());
  if (options.loss == Loss::squared) return fit_by_squares(inputs, outputs, options);
  FitOptions weighted = options;
  const Eigen::VectorXd weights = robust_weights(inputs, outputs, options);
  weighted.weights = options.weights.size() == 0 ? weights : options.weights.cwiseProduct(weights);
  FitResult result = fit_by_squares(inputs, outputs, weighted);
  result.summary.loss_weights = weights;
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
