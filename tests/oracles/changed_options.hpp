/// \file
/// Options of which one differs from its default, for tests that walk all of them.
#pragma once

#include <concepts>
#include <type_traits>
#include <vector>

#include "llmt/option_fields.hpp"

namespace oracle {

using llmt::choices;
using llmt::Trend;

/// Another value than the one that `value` has: a number that fits can have, another choice, a list with one entry.
template <class Value>
void change(Value& value) {
  if constexpr (std::same_as<Value, bool>) {
    value = !value;
  } else if constexpr (std::is_enum_v<Value>) {
    value = choices<Value>()[1].value == value ? choices<Value>()[0].value : choices<Value>()[1].value;
  } else if constexpr (std::same_as<Value, double>) {
    value = 0.25;
  } else if constexpr (std::integral<Value>) {
    value += 3;
  } else if constexpr (std::same_as<Value, std::vector<double>>) {
    value = {0.5};
  } else if constexpr (std::same_as<Value, std::vector<Trend>>) {
    value = {Trend::rising};
  } else {
    value = {0};
  }
}

/// An option's entry, and options that differ from the defaults in it alone.
template <class Options>
struct Changed {
  llmt::OptionField field;
  Options options;
};

template <class Options>
std::vector<Changed<Options>> each_changed() {
  std::vector<Changed<Options>> result;
  Options defaults;
  for_each_field(defaults, [&](const auto& field, auto& value) {
    const auto before = value;
    change(value);
    result.push_back({field, defaults});
    value = before;
  });
  return result;
}

}  // namespace oracle
