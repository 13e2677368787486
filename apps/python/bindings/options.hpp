/// \file
/// Options of a fit from a dict.
#pragma once

#include <nanobind/nanobind.h>

#include <string>
#include <string_view>

#include "llmt/boosted.hpp"
#include "llmt/option_fields.hpp"

namespace llmt::python {

namespace nb = nanobind;

/// Options by name, as type checkers are told.
using Options = nb::typed<nb::dict, nb::str, nb::any>;

/// The defaults, with what `given` holds: fields by the names that for_each_field() gives them ("max_leaves",
/// "folds.count"), choices by their names. Throws std::invalid_argument for a key that is none of them and for a name
/// that stands for no choice, and nb::type_error for a value of another type.
FitOptions options_of(const nb::dict& given);

/// The same of BoostOptions.
BoostOptions boost_options_of(const nb::dict& given);

/// The parameter of the estimator that an option of a fit is: "cv" of "folds.count". The option, if there is none.
std::string parameter_of(std::string_view option);

}  // namespace llmt::python
