/// \file
/// An order of columns that does not depend on where they stand.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt {

/// The columns of a table, ordered by a hash of how each of them goes up and down from row to row. Whatever draws
/// columns at random draws them in this order, so that the same seed draws the same columns of the same rows wherever
/// they stand in the table, and in whatever unit. Columns that go up and down together keep their order.
std::vector<int> column_order(const Eigen::Ref<const Eigen::MatrixXd>& table);

}  // namespace llmt
