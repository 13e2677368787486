/// \file
/// The leaves of a model: where each holds and what it says, as text and as JSON.
#pragma once

#include <string>

#include "llmt/model.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// Inputs with their ranges, then one table of leaves for each target. `name`: of the model. `width`: of tables.
std::string leaves_text(const Model& model, const std::string& name, std::size_t width = no_width_limit);

/// The same with all digits.
Json leaves_json(const Model& model);

}  // namespace llmt::report
