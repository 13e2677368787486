/// \file
/// The parts of the extension modules.
#pragma once

#include <nanobind/nanobind.h>

namespace llmt::python {

void add_arrow(nanobind::module_& module);
void add_fitting(nanobind::module_& module);
void add_found(nanobind::module_& module);
void add_models(nanobind::module_& module);
void add_signals(nanobind::module_& module);
void add_terms(nanobind::module_& module);

/// Of the module _robotics.
void add_robots(nanobind::module_& module);
void add_robot_tasks(nanobind::module_& module);

}  // namespace llmt::python
