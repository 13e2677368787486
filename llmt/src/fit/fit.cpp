#include "llmt/fit.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "fit/check_options.hpp"
#include "fit/fit_terms.hpp"
#include "fit/linear_or_quadratic.hpp"
#include "fit/robust_weights.hpp"

namespace llmt {
namespace {

FitResult fit_by_squares(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                         const Eigen::Ref<const Eigen::MatrixXd>& outputs, const FitOptions& options) {
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
