#include "model/through_regressors.hpp"

#include <cmath>

#include "model/held_product.hpp"

namespace llmt {

void add_through_regressors(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors,
                            const double* row, const Eigen::MatrixXd& by_regressor, Eigen::MatrixXd& by_input) {
  for (std::size_t k = 0; k < regressors.size(); ++k) {
    const Regressor& regressor = regressors[k];
    const auto derivative = by_regressor.col(k);
    if (is_product(regressor)) {
      const InputColumn& first = inputs[regressor.input];
      const InputColumn& second = inputs[regressor.second_input];
      const double x = row[regressor.input];
      const double z = row[regressor.second_input];
      if (!std::isnan(x) && !std::isnan(z)) {
        by_input.col(regressor.input) += derivative * (factor_derivative(first, x) * factor_at(second, z));
        by_input.col(regressor.second_input) += derivative * (factor_derivative(second, z) * factor_at(first, x));
      }
    } else if (regressor.level < 0) {
      by_input.col(regressor.input) += derivative;
    }
  }
}

}  // namespace llmt
