#include "constraints/signs.hpp"

#include <algorithm>

#include "numerics/bounded_least_squares.hpp"

namespace llmt {
namespace {

// Added to the diagonal of a node's Gram matrix, in rows and relative to them. It keeps the matrix positive definite,
// and the model as it is in directions that the rows do not determine.
constexpr double added_diagonal = 1e-9;

}  // namespace

std::vector<int> coefficient_signs(const TrainingRows& training) {
  const std::vector<int>& of_inputs = training.table->slope_signs;
  if (std::ranges::all_of(of_inputs, [](int sign) { return sign == 0; })) return {};
  std::vector<int> signs = {0};
  for (const Regressor& regressor : training.regressors) {
    signs.push_back(regressor.level < 0 ? of_inputs[regressor.input] : 0);
  }
  return signs;
}

bool has_signs(const std::vector<int>& signs, const Node& node) {
  for (Eigen::Index k = 1; k < std::ssize(signs); ++k) {
    if (signs[k] != 0 && (signs[k] * node.slope.col(k - 1).array() < 0.0).any()) {
      return false;
    }
  }
  return true;
}

void keep_signs_by_gram(const std::vector<int>& signs, const Eigen::MatrixXd& gram, const Eigen::VectorXd& scale,
                        Node& node) {
  Eigen::MatrixXd matrix = gram;
  matrix.diagonal().array() += added_diagonal * (1.0 + gram(0, 0));
  const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
  const Eigen::Index regressors = scale.size();
  for (Eigen::Index o = 0; o < node.value.size(); ++o) {
    Eigen::VectorXd model(regressors + 1);
    model << node.value(o), node.slope.row(o).transpose().cwiseProduct(scale);
    const Eigen::VectorXd moved = nearest_with_signs(factor, model, signs);
    node.rss(o) += std::max(0.0, (moved - model).dot(gram * (moved - model)));
    node.value(o) = moved(0);
    node.slope.row(o) = moved.tail(regressors).cwiseQuotient(scale).transpose();
  }
}

void keep_signs(const std::vector<int>& signs, const Eigen::MatrixXd& deviations, const Eigen::VectorXd& weights,
                Node& node) {
  if (has_signs(signs, node)) return;
  const Eigen::Index regressors = deviations.cols();
  const Eigen::VectorXd scale =
      (weights.transpose() * deviations.cwiseAbs2() / weights.sum()).cwiseSqrt().transpose().unaryExpr([](double size) {
        return size > 0.0 ? size : 1.0;
      });
  Eigen::MatrixXd a(deviations.rows(), regressors + 1);
  a << Eigen::VectorXd::Ones(deviations.rows()), deviations * scale.cwiseInverse().asDiagonal();
  keep_signs_by_gram(signs, a.transpose() * weights.asDiagonal() * a, scale, node);
}

}  // namespace llmt
