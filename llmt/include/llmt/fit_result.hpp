/// \file
/// What fit() returns.
///
///     const llmt::FitResult result = llmt::fit(inputs, output);
///     const llmt::Bounds bounds = result.intervals.predict(queries, 0.9);
#pragma once

#include "llmt/abi.hpp"
#include "llmt/intervals.hpp"
#include "llmt/model.hpp"
#include "llmt/summary.hpp"

namespace llmt {

struct FitResult {
  Model model;
  FitSummary summary;
  Intervals intervals;  ///< from the folds; empty without folds or without FitOptions::intervals
};

}  // namespace llmt
