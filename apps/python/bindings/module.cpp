#include "python/bindings/module.hpp"

#include "llmt/options.hpp"
#include "python/bindings/errors.hpp"

NB_MODULE(_core, module) {
  module.doc() = "The C++ library, bound. The classes of the package llmt are what people use.";
  module.attr("__version__") = LLMT_VERSION;
  module.attr("most_categories") = llmt::most_categories;
  llmt::python::register_errors();
  llmt::python::add_arrow(module);
  llmt::python::add_models(module);
  llmt::python::add_fitting(module);
  llmt::python::add_found(module);
  llmt::python::add_signals(module);
  llmt::python::add_terms(module);
}
