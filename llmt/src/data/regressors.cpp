#include "data/regressors.hpp"

#include <algorithm>
#include <cmath>

namespace llmt {
namespace {

// How many different values a column has; 3 stands for more.
int distinct_values(const Eigen::Ref<const Eigen::VectorXd>& column) {
  double first = std::nan("");
  double second = std::nan("");
  for (const double value : column) {
    if (std::isnan(value) || value == first || value == second) continue;
    if (std::isnan(first)) {
      first = value;
    } else if (std::isnan(second)) {
      second = value;
    } else {
      return 3;
    }
  }
  return std::isnan(first) ? 0 : std::isnan(second) ? 1 : 2;
}

}  // namespace

std::vector<int> numeric_regression_inputs(const Table& table) {
  std::vector<int> result;
  std::ranges::copy_if(table.regression_inputs, std::back_inserter(result),
                       [&](int input) { return table.num_levels[input] == 0; });
  return result;
}

Eigen::Index count_numeric_inputs(Eigen::Index inputs, const std::vector<int>& categorical, const FitOptions& options) {
  Eigen::Index count = 0;
  const std::vector<int>& chosen = options.regression_inputs;
  for (int input = 0; input < inputs; ++input) {
    const bool used = chosen.empty() || std::ranges::find(chosen, input) != chosen.end();
    count += used && std::ranges::find(categorical, input) == categorical.end() ? 1 : 0;
  }
  return count;
}

std::vector<std::pair<int, int>> products_of(const Table& table) {
  std::vector<int> inputs = numeric_regression_inputs(table);
  // The slope in an input that products change has no sign.
  std::erase_if(inputs, [&](int input) { return !table.slope_signs.empty() && table.slope_signs[input] != 0; });
  std::vector<int> distinct;
  for (const int input : inputs) {
    distinct.push_back(distinct_values(table.inputs.col(input)));
  }
  std::vector<std::pair<int, int>> result;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t j = i; j < inputs.size(); ++j) {
      if (distinct[i] > 1 && distinct[j] > 1 && (i != j || distinct[i] > 2)) {
        result.emplace_back(inputs[i], inputs[j]);
      }
    }
  }
  return result;
}

}  // namespace llmt
