/// \file
/// Options of a fit as a state keeps them: the bytes of those that a distributed fit takes, one after the other.
#pragma once

#include <concepts>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "base/sums.hpp"
#include "llmt/option_fields.hpp"

namespace llmt::distributed {

/// Appends a value. One of a type that cannot be kept does not compile.
template <class Value>
void write_option(const Value& value, std::string& bytes) {
  if constexpr (std::is_enum_v<Value>) {
    write(static_cast<std::int64_t>(value), bytes);
  } else if constexpr (std::same_as<Value, std::uint64_t> || std::same_as<Value, double>) {
    write(value, bytes);
  } else if constexpr (std::integral<Value>) {
    write(static_cast<std::int64_t>(value), bytes);
  } else {
    write(std::ssize(value), bytes);
    for (const auto& entry : value) write_option(entry, bytes);
  }
}

/// Takes a value off the front. Throws std::runtime_error if there is none that the type has.
template <class Value>
void read_option(std::string_view& bytes, Value& value) {
  if constexpr (std::same_as<Value, std::uint64_t> || std::same_as<Value, double>) {
    read(bytes, value);
  } else if constexpr (std::is_enum_v<Value> || std::integral<Value>) {
    std::int64_t number = 0;
    read(bytes, number);
    bool exists = false;
    if constexpr (std::is_enum_v<Value>) {
      for (const Choice<Value>& choice : choices<Value>()) {
        exists = exists || static_cast<std::int64_t>(choice.value) == number;
      }
    } else if constexpr (std::same_as<Value, bool>) {
      exists = number == 0 || number == 1;
    } else {
      exists = std::in_range<Value>(number);
    }
    if (!exists) throw std::runtime_error("an option does not go with the rest");
    value = static_cast<Value>(number);
  } else {
    std::ptrdiff_t count = 0;
    read(bytes, count);
    if (count < 0 || count > std::ssize(bytes)) throw std::runtime_error("an option does not go with the rest");
    value.resize(count);
    for (auto& entry : value) read_option(bytes, entry);
  }
}

/// The options that distributed::start() takes, in the order of for_each_field(). Throws OptionRefused for one that it
/// refuses.
template <class Options>
std::string kept(const Options& options) {
  require_taken(options, beyond_memory);
  std::string bytes;
  for_each_field(options, [&](const auto& field, const auto& value) {
    if (field.beyond_memory.is_taken()) write_option(value, bytes);
  });
  return bytes;
}

/// What kept() was given; the other options have their defaults. Throws std::runtime_error for bytes that are not its.
template <class Options>
Options from_kept(std::string_view bytes) {
  Options options;
  for_each_field(options, [&](const auto& field, auto& value) {
    if (field.beyond_memory.is_taken()) read_option(bytes, value);
  });
  try {
    require_taken(options, beyond_memory);
  } catch (const OptionRefused&) {
    bytes = "refused";
  }
  if (!bytes.empty()) throw std::runtime_error("an option does not go with the rest");
  return options;
}

}  // namespace llmt::distributed
