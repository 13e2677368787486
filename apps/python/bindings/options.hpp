/// \file
/// Options of a fit from a dict.
#pragma once

#include <nanobind/nanobind.h>

#include "llmt/boosted.hpp"
#include "llmt/options.hpp"
#include "llmt/stream_options.hpp"

namespace llmt::python {

namespace nb = nanobind;

/// Options by name, as type checkers are told.
using Options = nb::typed<nb::dict, nb::str, nb::any>;

/// The defaults, with what `given` holds: members of FitOptions, ExpertOptions and FoldOptions by their names (folds as
/// "folds", "contiguous" and "seed"), choices by their names. Throws std::invalid_argument for a key that is none of
/// them and for a name that stands for no choice, and std::bad_cast for a value of another type.
FitOptions options_of(const nb::dict& given);

/// The same of StreamOptions.
StreamOptions stream_options_of(const nb::dict& given);

/// The same of BoostOptions.
BoostOptions boost_options_of(const nb::dict& given);

}  // namespace llmt::python
