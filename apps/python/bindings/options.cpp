#include "python/bindings/options.hpp"

#include <fmt/format.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace llmt::python {
namespace {

template <class Value>
void take(nb::handle given, Value& value) {
  if constexpr (std::is_enum_v<Value>) {
    value = parse<Value>(nb::cast<std::string>(given));
  } else if constexpr (std::is_same_v<Value, std::vector<Trend>>) {
    value.clear();
    for (const auto& name : nb::cast<std::vector<std::string>>(given)) value.push_back(parse<Trend>(name));
  } else {
    value = nb::cast<Value>(given);
  }
}

// The name of a field: OptionField, or the name itself.
std::string name_of_field(const OptionField& field) { return std::string(field.name); }
std::string name_of_field(const char* name) { return name; }

template <class Options>
Options options_from(const nb::dict& given) {
  Options options;
  std::set<std::string> known;
  for_each_field(options, [&](const auto& field, auto& value) {
    const std::string name = name_of_field(field);
    known.insert(name);
    if (!given.contains(name.c_str())) return;
    const nb::object of_option = given[name.c_str()];
    try {
      take(of_option, value);
    } catch (const nb::cast_error&) {
      throw nb::type_error(
          fmt::format("option \"{}\": {} is of the wrong type", name, nb::repr(of_option).c_str()).c_str());
    }
  });
  for (const auto& [key, value] : given) {
    if (const auto name = nb::cast<std::string>(key); !known.contains(name)) {
      throw std::invalid_argument(fmt::format("there is no option \"{}\"", name));
    }
  }
  return options;
}

// How the estimator reads a parameter.
template <class Value>
const char* kind_of(const Value&) {
  if constexpr (std::is_same_v<Value, bool>) return "switch";
  if constexpr (std::is_integral_v<Value>) return "count";
  if constexpr (std::is_enum_v<Value>) return "choice";
  return "other";
}

template <class Value>
nb::list names_of_choices(const Value&) {
  nb::list names;
  if constexpr (std::is_enum_v<Value>) {
    for (const Choice<Value>& choice : choices<Value>()) names.append(std::string(choice.name));
  }
  return names;
}

}  // namespace

FitOptions options_of(const nb::dict& given) { return options_from<FitOptions>(given); }

BoostOptions boost_options_of(const nb::dict& given) { return options_from<BoostOptions>(given); }

std::string parameter_of(std::string_view option) {
  for (const OptionField& field : option_fields()) {
    if (field.name == option && !field.parameter.empty()) return std::string(field.parameter);
  }
  return std::string(option);
}

void add_options(nb::module_& module) {
  module.def("fit_fields", [] {
    nb::list fields;
    const FitOptions options;
    for_each_field(options, [&](const OptionField& field, const auto& value) {
      nb::dict entry;
      entry["name"] = std::string(field.name);
      entry["parameter"] = std::string(field.parameter);
      entry["kind"] = kind_of(value);
      entry["choices"] = names_of_choices(value);
      fields.append(entry);
    });
    return fields;
  });
}

}  // namespace llmt::python
