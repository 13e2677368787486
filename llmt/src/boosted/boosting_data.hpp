/// \file
/// The rows of a boosted fit: checked, equal ones put together, dealt to what is held out.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "boosted/binned_rows.hpp"
#include "boosted/regime.hpp"
#include "llmt/boosted.hpp"

namespace llmt {

/// Which rows boosting learns from, and which stop it.
struct HoldOut {
  std::vector<int> train;
  std::vector<int> held_out;
};

/// The inputs stand in an order that does not depend on where the caller has them: column_order().
struct BoostingData {
  std::vector<int> columns;  ///< of the caller, for each input
  std::vector<InputColumn> inputs;
  std::vector<OutputColumn> outputs;
  std::vector<double> deviations;
  Regime regime;
  BinnedRows rows;                 ///< with a feature for each numeric input and each level
  Eigen::MatrixXd y;               ///< outputs of the rows
  std::vector<HoldOut> hold_outs;  ///< empty: too few rows, whose mean is the model
  std::vector<int> parts;          ///< of each row; hold_outs[k] holds the part k out
  bool is_hold_out_given = false;  ///< TrainingData::held_out: these rows are not fitted to
  Eigen::MatrixXd x;               ///< inputs of the rows
  Eigen::VectorXd precisions;      ///< weights of the rows as given, if they are no counts; empty: none
};

/// Throws std::invalid_argument as fit_boosted().
BoostingData boosting_data(const TrainingData& data, const BoostOptions& options);

/// A feature of the rows.
BinnedFeature feature_of(const BoostingData& data, const BoostedFeature& feature);

/// The rows of one part are held out. `parts`: of each row.
HoldOut part_apart(const std::vector<int>& parts, int part);

}  // namespace llmt
