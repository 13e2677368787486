/// \file
/// The parts of the extension module.
#pragma once

#include <nanobind/nanobind.h>

namespace llmt::python {

void add_arrow(nanobind::module_& module);
void add_fitting(nanobind::module_& module);
void add_models(nanobind::module_& module);

}  // namespace llmt::python
