/// \file
/// Matrices whose rows are contiguous.
#pragma once

#include <Eigen/Core>

namespace llmt {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace llmt
