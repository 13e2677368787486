/// \file
/// What a teacher brought a tree, as text and as JSON.
#pragma once

#include <string>

#include "llmt/teach.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

Json teaching_json(const TaughtResult& taught);

/// "One tree 5.00, taught tree 4.70, sum 4.01", and what it means. `width`: of lines.
std::string teaching_text(const TaughtResult& taught, std::size_t width = no_width_limit);

}  // namespace llmt::report
