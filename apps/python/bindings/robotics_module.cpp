#include <nanobind/stl/string.h>

#include "python/bindings/errors.hpp"
#include "python/bindings/module.hpp"

NB_MODULE(_robotics, module) {
  module.doc() = "The robot layer, bound. The classes of llmt.robotics are what people use.";
  llmt::python::register_errors();
  llmt::python::add_robots(module);
  llmt::python::add_robot_tasks(module);
  module.def("in_words", [](const std::string& text) { return llmt::python::in_words_of_python(text); });
}
