/// \file
/// Rows between those of the data.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "llmt/teach.hpp"

namespace llmt {

struct MadeRows {
  Eigen::MatrixXd inputs;
  std::vector<int> made_of;  ///< of each the row whose coordinates it has where they are not swapped
};

/// Rows that swap coordinates with near ones, see fit_taught(). `categorical`: columns of the inputs.
MadeRows make_rows(const Eigen::MatrixXd& inputs, const std::vector<int>& categorical, const TeachOptions& options,
                   int max_threads);

}  // namespace llmt
