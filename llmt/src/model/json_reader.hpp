/// \file
/// Reading JSON whose errors say where they are.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <concepts>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/json_parser.hpp"

namespace llmt {

/// A JSON value together with the way to it. All readers throw std::runtime_error that begins with the way, if a member
/// is missing or a value has the wrong type or size.
class JsonReader {
 public:
  /// `where`: name of the file, with the way to the value behind it as a JSON pointer, `path: /member/0`. `json` must
  /// live as long as this.
  JsonReader(const Json& json, std::string where) : json_(json), where_(std::move(where)) {}

  JsonReader member(const char* key) const;
  bool has(const char* key) const { return json_.is_object() && json_.contains(key); }
  std::vector<JsonReader> elements() const;
  Eigen::Index size() const { return std::ssize(array()); }

  /// A number, whole number or text.
  template <class Value>
  Value as() const {
    if (!fits<Value>(json_)) fail(fmt::format("{} is needed, not {}", description<Value>(), quotable(json_)));
    if constexpr (std::integral<Value>) {
      const bool in_range = json_.is_number_unsigned() ? std::in_range<Value>(json_.get<std::uint64_t>())
                                                       : std::in_range<Value>(json_.get<std::int64_t>());
      if (!in_range) fail(fmt::format("{} is out of range", quotable(json_)));
    }
    return json_.get<Value>();
  }

  /// The value of a member, or `otherwise` if there is no such member.
  template <class Value>
  Value as(const char* key, Value otherwise) const {
    return has(key) ? member(key).as<Value>() : otherwise;
  }

  template <class Value>
  std::vector<Value> list() const {
    std::vector<Value> result;
    for (const Json& element : array()) {
      if (!std::integral<Value> && fits<Value>(element)) {
        result.push_back(element.get<Value>());
      } else {
        result.push_back(JsonReader(element, child(std::to_string(result.size()))).as<Value>());
      }
    }
    return result;
  }

  Eigen::VectorXd vector(Eigen::Index size) const;

  /// A matrix as an array of rows.
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index columns) const;

  /// Throws std::runtime_error with the way to this value before `what`. `pointer`: the way on from here, `/nodes/3`.
  [[noreturn]] void fail(const std::string& what) const { fail_at("", what); }
  [[noreturn]] void fail_at(const std::string& pointer, const std::string& what) const;

 private:
  template <class Value>
  static bool fits(const Json& json) {
    if constexpr (std::same_as<Value, std::string>) return json.is_string();
    if constexpr (std::integral<Value>) return json.is_number_integer();
    return json.is_number();
  }

  template <class Value>
  static const char* description() {
    if constexpr (std::same_as<Value, std::string>) return "a text";
    if constexpr (std::integral<Value>) return "a whole number";
    return "a number";
  }

  const Json& array() const;
  std::string at(const std::string& pointer) const;
  std::string child(const std::string& key) const { return at("/" + key); }

  const Json& json_;
  std::string where_;
};

}  // namespace llmt
