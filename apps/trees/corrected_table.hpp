/// \file
/// The corrected simulation as a table.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "trees/compared_tables.hpp"

namespace llmt::apps {

/// Rows of inputs and outputs, before and after.
struct CorrectedTable {
  std::vector<std::string> inputs;
  std::vector<std::string> outputs;
  Eigen::MatrixXd values;     ///< n x p
  Eigen::MatrixXd simulated;  ///< n x d
  Eigen::MatrixXd corrected;  ///< n x d
  Eigen::MatrixXd measured;   ///< n x d, or empty
  std::vector<LabelColumn> labels = {};
};

/// Writes the labels that are no inputs, a column for each input, and for each output those whose names end with
/// _simulated, _corrected and _measured.
void write_corrected(const std::string& path, const CorrectedTable& table);

}  // namespace llmt::apps
