/// \file
/// How a sum of trees was made, as text and as JSON.
#pragma once

#include <string>

#include "llmt/boosted.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

struct BoostedRun {
  std::string data;    ///< the name of the table
  std::string output;  ///< the file of the model; empty: none
};

/// Rows, trees, errors and the variants that were compared, for every target.
Json boosted_json(const BoostedRun& run, const BoostResult& result);

/// The same for people. `width`: of tables.
std::string boosted_text(const BoostedRun& run, const BoostResult& result, std::size_t width = no_width_limit);

}  // namespace llmt::report
