/// \file
/// Reading JSON whose errors say where they are.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace llmt {

using Json = nlohmann::ordered_json;

/// The format of model files, as their members "format" and "version" say.
inline constexpr const char* model_format_name = "llmt-model";
inline constexpr int model_format_version = 2;

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

  /// A number, whole number or text.
  template <class Value>
  Value as() const {
    if (!fits<Value>()) fail(fmt::format("{} is needed, not {}", description<Value>(), json_.dump().substr(0, 40)));
    if constexpr (std::is_integral_v<Value>) {
      const std::int64_t value = json_.get<std::int64_t>();
      if (!std::in_range<Value>(value)) fail(fmt::format("{} is out of range", value));
      return static_cast<Value>(value);
    } else {
      return json_.get<Value>();
    }
  }

  /// The value of a member, or `otherwise` if there is no such member.
  template <class Value>
  Value as(const char* key, Value otherwise) const {
    return has(key) ? member(key).as<Value>() : otherwise;
  }

  template <class Value>
  std::vector<Value> list() const {
    std::vector<Value> result;
    for (const JsonReader& element : elements()) {
      result.push_back(element.as<Value>());
    }
    return result;
  }

  Eigen::VectorXd vector(Eigen::Index size) const;

  /// A matrix as an array of rows.
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index columns) const;

  /// Throws std::runtime_error with the way to this value before `what`.
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(fmt::format("{}: {}", where_, what));
  }

 private:
  template <class Value>
  bool fits() const {
    if constexpr (std::is_same_v<Value, std::string>) return json_.is_string();
    if constexpr (std::is_integral_v<Value>) return json_.is_number_integer();
    return json_.is_number();
  }

  template <class Value>
  static const char* description() {
    if constexpr (std::is_same_v<Value, std::string>) return "a text";
    if constexpr (std::is_integral_v<Value>) return "a whole number";
    return "a number";
  }

  std::string child(const std::string& key) const;

  const Json& json_;
  std::string where_;
};

}  // namespace llmt
