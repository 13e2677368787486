/// \file
/// A spread, gaps and a record of the training rows as JSON values: docs/file-formats.md.
#pragma once

#include "llmt/gaps.hpp"
#include "llmt/spread.hpp"
#include "llmt/training_record.hpp"
#include "model_files/json_reader.hpp"

namespace llmt {

Json json_of(const Spread& spread);
Json json_of(const std::vector<Gap>& gaps);
Json json_of(const TrainingRecord& record);

/// Throws std::runtime_error if a member is missing or has the wrong type. check_spread() does the rest.
Spread spread_from(const JsonReader& json);

/// The member `gaps` of a model; none if there is none. check_gaps() does the rest.
std::vector<Gap> gaps_from(const JsonReader& model);

/// The member `training` of a model; an empty record if there is none. check_record() does the rest.
TrainingRecord record_from(const JsonReader& model);

}  // namespace llmt
