#include "python/bindings/module.hpp"

#include "python/bindings/errors.hpp"

NB_MODULE(_core, module) {
  namespace nb = nanobind;
  module.doc() = "The C++ library, bound. The classes of the package llmt are what people use.";
  module.attr("__version__") = LLMT_VERSION;
  llmt::python::register_errors();
  llmt::python::add_models(module);
  llmt::python::add_fitting(module);
  llmt::python::add_terms(module);
}
