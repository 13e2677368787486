/// \file
/// A fit that ends within a time: of the largest tree, or the longest sum, for which the time is enough.
///
///     const llmt::TimedSum timed = llmt::fit_boosted_within(10.0, {inputs, outputs});   // seconds
///     llmt::save(timed.result.model, "model.json");
///     // The same model, to the byte, on any machine: timed.options.max_rounds says how many rounds the time was for.
///     const llmt::BoostResult again = llmt::fit_boosted({inputs, outputs}, timed.options);
#pragma once

#include <memory>

#include "llmt/abi.hpp"
#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/progress.hpp"

namespace llmt {

/// What a time limit did to a fit.
struct TimeLimit {
  double seconds = 0.0;     ///< as given
  double taken = 0.0;       ///< until the result was there
  Eigen::Index size = 0;    ///< leaves of a tree, or rounds of a sum, at most: what the time was enough for
  bool is_binding = false;  ///< the size is less than without a time limit
};

struct TimedTree {
  PreparedFit prepared;  ///< what `fit` was made from, for fit_readable()
  FitResult fit;
  FitOptions options;  ///< with the largest number of leaves that the time was enough for
  TimeLimit time;
};

struct TimedSum {
  BoostResult result;
  BoostOptions options;  ///< with the largest number of rounds that the time was enough for
  TimeLimit time;
};

/// The fit() with the largest FitOptions::max_leaves, up to that of `options`, that ends within `seconds` from the
/// call.
///
/// First a tree of at most 8 leaves is fitted, to its end, whatever the time. Its time says how many leaves the next
/// may have, at most all. A fit that is under way when the time is over is given up, and the one before it is the
/// result. So the size, and with it the model, depends on the machine; `options` of the result make the same model
/// anywhere.
///
/// `progress` is told the share of the time that is over. Throws as fit(), and std::invalid_argument if `seconds` is
/// not a finite number above 0.
TimedTree fit_within(double seconds, std::shared_ptr<const TrainingData> data, const FitOptions& options = {},
                     const Progress& progress = {});

/// The fit_boosted() with the largest BoostOptions::max_rounds, up to that of `options`, that ends within `seconds`, as
/// fit_within(); the first has at most 32 rounds. Throws as fit_boosted().
TimedSum fit_boosted_within(double seconds, const TrainingData& data, const BoostOptions& options = {},
                            const Progress& progress = {});

}  // namespace llmt
