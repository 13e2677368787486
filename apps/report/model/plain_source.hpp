/// \file
/// A readable tree as source that a person reads: plain if and equations, no tables.
#pragma once

#include <string>

#include "llmt/model.hpp"

namespace llmt::report {

enum class PlainLanguage { c, python, sql };

/// One function for each target, NAME_TARGET(inputs) in C and Python; in SQL a query with a column for each target, of
/// a table NAME. They predict what the model does, to rounding: also missing values (NAN, None, NULL), unknown
/// categories, and inputs beyond the training range, which are held there by a helper. Numbers are finite.
/// `model_name`: for the comment on top.
///
/// Throws std::runtime_error that says why if the model is more than its rules, as all but readable trees are.
std::string plain_source(const Model& model, PlainLanguage language, const std::string& name,
                         const std::string& model_name);

}  // namespace llmt::report
