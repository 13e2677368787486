/// \file
/// What can be seen of a sum of trees, as text and as JSON: its size, and how often it uses each input.
#pragma once

#include <string>

#include "llmt/boosted_model.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// Inputs with their ranges, then the size of each target's sum and the uses of the inputs. `name`: of the model.
/// `width`: of tables.
std::string boosted_inspection_text(const BoostedModel& model, const std::string& name,
                                    std::size_t width = no_width_limit);

/// The same with all digits.
Json boosted_inspection_json(const BoostedModel& model);

}  // namespace llmt::report
