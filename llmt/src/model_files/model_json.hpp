/// \file
/// A model as a JSON value: docs/file-formats.md.
#pragma once

#include "llmt/boosted_model.hpp"
#include "llmt/model.hpp"
#include "model_files/json_reader.hpp"

namespace llmt {

/// The format of model files, as their members "format" and "version" say.
inline constexpr const char* model_format_name = "llmt-model";
inline constexpr int model_format_version = 2;
/// The version of a file with an output_range, which programs that know version 2 alone would ignore.
inline constexpr int model_format_version_with_range = 3;
/// The version of a file with codes, which earlier programs would take for positions.
inline constexpr int model_format_version_with_codes = 4;
/// The version of a file in which a missing value is a level of a category, which earlier programs would not see.
inline constexpr int model_format_version_with_empty_levels = 5;

/// The format of boosted models, which this is no version of. Since version 2 a row may go to both sides of a split
/// whose feature it lacks.
inline constexpr const char* boosted_format_name = "llmt-boosted-model";
inline constexpr int boosted_format_version = 3;

/// The format of models of systems that move, whose tree or sum of trees is a member.
inline constexpr const char* dynamic_format_name = "llmt-dynamic-model";
inline constexpr int dynamic_format_version = 1;

/// The value that to_json() writes.
Json json_of(const Model& model);

/// The text of a value, as model files have it. Throws std::runtime_error if a name is not valid UTF-8, and if it would
/// be refused where it is read: beyond Limit::model_values or Limit::model_bytes.
std::string model_text(const Json& json);

/// The same on one line, for a sum of trees, of which nobody reads the file.
std::string compact_text(const Json& json);

/// The model in a value, whatever other members it has. Throws std::runtime_error with the way to the part that cannot
/// be accepted.
Model model_from(const JsonReader& json);

/// The same of sums of trees.
Json json_of(const BoostedModel& model);
BoostedModel boosted_model_from(const JsonReader& json);

/// Whether a value says that it is a model of a system that moves.
bool is_dynamic_model(const JsonReader& json);

}  // namespace llmt
