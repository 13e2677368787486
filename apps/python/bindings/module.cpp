#include "python/bindings/module.hpp"

#include <exception>
#include <stdexcept>

#include "llmt/options.hpp"
#include "llmt/progress.hpp"

namespace {

// The library throws std::runtime_error for texts and tables that it cannot take: values, in the words of Python.
void translate(const std::exception_ptr& thrown, void* /*payload*/) {
  try {
    std::rethrow_exception(thrown);
  } catch (const llmt::Cancelled& error) {
    PyErr_SetString(PyExc_InterruptedError, error.what());
  } catch (const std::runtime_error& error) {
    PyErr_SetString(PyExc_ValueError, error.what());
  }
}

}  // namespace

NB_MODULE(_core, module) {
  namespace nb = nanobind;
  module.doc() = "The C++ library, bound. The classes of the package llmt are what people use.";
  module.attr("__version__") = LLMT_VERSION;
  module.attr("most_categories") = llmt::most_categories;
  nb::register_exception_translator(translate);
  llmt::python::add_arrow(module);
  llmt::python::add_models(module);
  llmt::python::add_fitting(module);
}
