/// \file
/// The parts of the extension module.
#pragma once

#include <nanobind/nanobind.h>

namespace llmt::python {

void add_arrow(nanobind::module_& module);
void add_boosted(nanobind::module_& module);
void add_distributed(nanobind::module_& module);
void add_dynamics(nanobind::module_& module);
void add_fitting(nanobind::module_& module);
void add_found(nanobind::module_& module);
void add_models(nanobind::module_& module);
void add_options(nanobind::module_& module);
void add_signals(nanobind::module_& module);
void add_terms(nanobind::module_& module);
void add_words(nanobind::module_& module);

/// Where the robot layer is built.
void add_robots(nanobind::module_& module);
void add_robot_tasks(nanobind::module_& module);

}  // namespace llmt::python
