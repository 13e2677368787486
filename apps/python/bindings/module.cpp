#include "python/bindings/module.hpp"

#include <nanobind/stl/string.h>

#include "llmt/files.hpp"
#include "llmt/options.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/interruptible.hpp"

NB_MODULE(_core, module) {
  module.doc() = "The C++ library, bound. The classes of the package llmt are what people use.";
  module.attr("__version__") = LLMT_VERSION;
  module.attr("most_categories") = llmt::most_categories;
  module.attr("largest_magnitude") = llmt::largest_magnitude;
  llmt::python::register_errors();
  module.def("looks_for_signals", &llmt::python::looks_for_signals,
             "How often long calls have looked whether Ctrl-C was pressed.");
  module.def(
      "write_file",
      [](const nanobind::bytes& path, const std::string& content) {
        const llmt::NewFile file{{path.c_str(), path.size()}, content};
        llmt::python::write_or_raise({&file, 1});
      },
      nanobind::arg("path"), nanobind::arg("content"), "Writes a file as a whole or, with an OSError, not at all.");
  module.def(
      "write_file",
      [](const nanobind::bytes& path, const nanobind::bytes& content) {
        const llmt::NewFile file{{path.c_str(), path.size()}, {content.c_str(), content.size()}};
        llmt::python::write_or_raise({&file, 1});
      },
      nanobind::arg("path"), nanobind::arg("content"));
  llmt::python::add_arrow(module);
  llmt::python::add_models(module);
  llmt::python::add_boosted(module);
  llmt::python::add_distributed(module);
  llmt::python::add_dynamics(module);
  llmt::python::add_fitting(module);
  llmt::python::add_found(module);
  llmt::python::add_options(module);
  llmt::python::add_signals(module);
  llmt::python::add_terms(module);
  llmt::python::add_words(module);
#ifdef LLMT_HAS_ROBOTS
  llmt::python::add_robots(module);
  llmt::python::add_robot_tasks(module);
#endif
}
