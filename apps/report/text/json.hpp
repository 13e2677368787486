/// \file
/// JSON as the reports write it.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace llmt::report {

/// Members stay in the order in which they are added.
using Json = nlohmann::ordered_json;

/// null for NaN and infinity, which JSON does not have.
inline Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

}  // namespace llmt::report
