/// \file
/// JSON from text of any origin.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

namespace llmt {

using Json = nlohmann::ordered_json;

/// A value whose end takes no memory. nlohmann's destructor takes as much as the longest array and ends the program
/// where that is not there, as when a file has just proved too large for the memory.
class JsonDocument {
 public:
  JsonDocument() = default;
  ~JsonDocument();
  JsonDocument(JsonDocument&& other) noexcept : value_(std::move(other.value_)) {}
  JsonDocument& operator=(JsonDocument&&) = delete;

  Json& value() { return value_; }
  const Json& value() const { return value_; }

 private:
  Json value_;
};

/// Parses a text. Throws std::runtime_error that begins with `name` and the JSON pointer to the place, for what is not
/// JSON, nests deeper than Limit::json_levels, has an object with more than Limit::json_members or one member twice, a
/// number beyond the range of a double, or more than `most_values` values. No value of the result is nested deeper than
/// Limit::json_levels, so that functions that call themselves for every level are safe.
JsonDocument parse_json(const std::string& text, const std::string& name,
                        std::size_t most_values = std::numeric_limits<std::size_t>::max());

/// A text of a file as messages quote it: at most 40 bytes, and a question mark for what is no printable ASCII.
std::string quotable(const std::string& text);

/// A value as messages quote it, however large it is: a scalar as it is written, else "an object" or "an array".
std::string quotable(const Json& value);

}  // namespace llmt
