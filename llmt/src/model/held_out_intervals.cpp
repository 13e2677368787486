#include "model/held_out_intervals.hpp"

#include <utility>

#include "model/incomplete.hpp"

namespace llmt {

Intervals held_out_intervals(std::vector<Model> models, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                             const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                             const std::vector<std::span<const int>>& held_out, int max_threads) {
  const std::vector<bool> incomplete = incomplete_rows(models, inputs);
  std::vector<Eigen::MatrixXd> residuals;
  std::vector<Eigen::MatrixXd> residuals_incomplete;
  for (std::size_t f = 0; f < models.size(); ++f) {
    std::vector<int> whole;
    std::vector<int> lacking;
    for (const int row : held_out[f]) (incomplete[row] ? lacking : whole).push_back(row);
    const auto residuals_of = [&](const std::vector<int>& rows) -> Eigen::MatrixXd {
      return (outputs(rows, Eigen::all) - models[f].predict(inputs(rows, Eigen::all), max_threads)).cwiseAbs();
    };
    residuals.push_back(residuals_of(whole));
    residuals_incomplete.push_back(residuals_of(lacking));
  }
  return {std::move(models), std::move(residuals), std::move(residuals_incomplete)};
}

}  // namespace llmt
