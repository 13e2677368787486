/// \file
/// How a sum of trees was made, as text and as JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "llmt/boosted.hpp"
#include "llmt/time_limit.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

struct BoostedRun {
  std::string data;                       ///< the name of the table
  std::string output;                     ///< the file of the model; empty: none
  std::vector<double> rmse_of_mean = {};  ///< one a target: of the mean of the rows; empty: not shown
  std::optional<TimeLimit> time = {};     ///< where one was given
};

/// Rows, trees, errors and the variants that were compared, for every target.
Json boosted_json(const BoostedRun& run, const BoostResult& result);

/// The same for people. `width`: of tables.
std::string boosted_text(const BoostedRun& run, const BoostResult& result, std::size_t width = no_width_limit);

}  // namespace llmt::report
