/// \file
/// Products of two numbers as columns of the local models.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "llmt/model.hpp"

namespace llmt {

struct Table;
struct TrainingRows;

inline bool is_product(const Regressor& regressor) { return regressor.second_input >= 0; }

/// Products make (d + 1) (d + 2) / 2 coefficients of d numbers, and growth costs the square of that: beyond so many
/// numeric regression inputs (105 coefficients) there are none.
inline constexpr std::ptrdiff_t most_inputs_of_products = 13;

/// Numeric regression inputs of a table.
std::vector<int> numeric_regression_inputs(const Table& table);

/// All pairs of numeric regression inputs, i <= j, that say something of their own: none of an input that never varies,
/// no square of one that takes two values.
std::vector<std::pair<int, int>> products_of(const Table& table);

/// The product of the deviations of two inputs with its weighted mean over the rows, where both have a value.
Regressor product_regressor(const TrainingRows& training, const std::pair<int, int>& inputs);

/// Derivatives with respect to regressors at a row of inputs turned into those with respect to inputs, and added.
/// `by_regressor` outputs x regressors, `by_input` outputs x inputs. Levels have none, nor products with a factor that
/// is missing.
void add_through_regressors(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors,
                            const double* row, const Eigen::MatrixXd& by_regressor, Eigen::MatrixXd& by_input);

}  // namespace llmt
