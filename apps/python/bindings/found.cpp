#include <nanobind/nanobind.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <map>
#include <string>
#include <vector>

#include "python/bindings/arrays.hpp"
#include "python/bindings/module.hpp"
#include "report/terms/found_terms.hpp"

namespace llmt::python {
namespace {

constexpr const char* where = "what was found";

nb::dict names_of_found(const std::string& json) {
  const report::FoundTerms found = report::found_terms(json, where);
  std::vector<std::string> parameters;
  for (const report::FoundTerms::Change& change : found.changes) parameters.push_back(change.parameter);
  nb::dict names;
  names["inputs"] = found.input_names();
  names["outputs"] = found.output_names();
  names["parameters"] = parameters;
  return names;
}

auto apply_found(const std::string& json, const Array& inputs, const Array& simulated,
                 const std::map<std::string, Array>& derivatives, const std::vector<double>& instants,
                 const std::vector<Eigen::Index>& runs) {
  std::map<std::string, Eigen::MatrixXd> by;
  for (const auto& [name, values] : derivatives) by[name] = rows_of(values);
  const Eigen::Map<const Eigen::VectorXd> times(instants.data(), std::ssize(instants));
  return array_of<double>(
      report::apply(report::found_terms(json, where), rows_of(inputs), rows_of(simulated), by, {times, runs}));
}

std::string code_of_found(const std::string& json, bool python) {
  return report::correction_code(report::found_terms(json, where),
                                 python ? report::CodeLanguage::python : report::CodeLanguage::c);
}

}  // namespace

void add_found(nb::module_& module) {
  using nb::arg;
  module.def("names_of_found", &names_of_found, arg("json"));
  module.def("apply_found", &apply_found, arg("json"), arg("inputs"), arg("simulated"), arg("derivatives"),
             arg("instants"), arg("runs"));
  module.def("code_of_found", &code_of_found, arg("json"), arg("python"));
}

}  // namespace llmt::python
