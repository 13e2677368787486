/// \file
/// The rows of a boosted fit: checked, equal ones put together, dealt to what is held out.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "boosted/binned_rows.hpp"
#include "llmt/boosted.hpp"

namespace llmt {

/// Above this number of rows fewer than a fifth are held out, all are in random order, and the rate is larger.
inline constexpr Eigen::Index many_rows = 100000;

/// Which rows boosting learns from, and which stop it.
struct HoldOut {
  std::vector<int> train;
  std::vector<int> held_out;
};

struct BoostingData {
  std::vector<InputColumn> inputs;
  std::vector<OutputColumn> outputs;
  std::vector<double> deviations;
  BinnedRows rows;                 ///< with a feature for each numeric input and each level
  Eigen::MatrixXd y;               ///< outputs of the rows
  std::vector<HoldOut> hold_outs;  ///< empty: too few rows, whose mean is the model
  std::vector<int> parts;  ///< of each row, 0 ... 4; the set k of hold_outs is the part k. Empty: given, or none
  bool is_hold_out_given = false;  ///< TrainingData::held_out: these rows are not fitted to
  Eigen::MatrixXd x;               ///< inputs of the rows
};

/// Throws std::invalid_argument as fit_boosted().
BoostingData boosting_data(const TrainingData& data, const BoostOptions& options);

/// Puts a feature behind those that are there.
void add_feature(BoostingData& data, const BoostedFeature& feature);

}  // namespace llmt
