/// \file
/// A spread as a JSON value: docs/file-formats.md.
#pragma once

#include "llmt/spread.hpp"
#include "model_files/json_reader.hpp"

namespace llmt {

Json json_of(const Spread& spread);

/// Throws std::runtime_error if a member is missing or has the wrong type. check_spread() does the rest.
Spread spread_from(const JsonReader& json);

}  // namespace llmt
