/// \file
/// The two directions between the parts of a stream and JSON. A part lists its fields once, in a function
/// fields(archive, part), for a StreamWriter and for a StreamReader.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "model_files/json_reader.hpp"
#include "numerics/gram.hpp"

namespace llmt {

/// A count that is read may not be larger: 2^53.
inline constexpr std::int64_t largest_stream_count = std::int64_t{1} << 53;

/// A number; JSON has no NaN and no infinity, so these are the texts "nan", "inf" and "-inf".
inline Json number_json(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0.0 ? "inf" : "-inf";
}

inline double number_from(const JsonReader& json) {
  if (!json.is_text()) return json.as<double>();
  const std::string text = json.as<std::string>();
  if (text == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (text == "inf") return std::numeric_limits<double>::infinity();
  if (text == "-inf") return -std::numeric_limits<double>::infinity();
  json.fail(fmt::format("a number, \"nan\", \"inf\" or \"-inf\" is needed, not \"{}\"", quotable(text)));
}

/// Calls visit(position) for the entries of `count` Gram matrices that StreamWriter::grams() writes.
template <class Visit>
void for_each_entry(const GramShape& shape, Eigen::Index count, const Visit& visit) {
  for (Eigen::Index matrix = 0; matrix < count; ++matrix) {
    for (Eigen::Index i = 0; i < shape.columns(); ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) visit(matrix * shape.size() + shape.at(i, j));
    }
  }
}

/// Takes the values of a part as members of an object.
class StreamWriter {
 public:
  static constexpr bool reads = false;
  explicit StreamWriter(Json& object) : object_(object) { object_ = Json::object(); }

  void number(const char* key, double value) { object_[key] = number_json(value); }
  void flag(const char* key, bool value) { object_[key] = value ? 1 : 0; }
  template <class Whole>
  void count(const char* key, Whole value, int /*low*/, std::int64_t /*high*/ = 0) {
    object_[key] = value;
  }
  template <class Numbers>
  void numbers(const char* key, const Numbers& values, Eigen::Index /*size*/) {
    Json& list = object_[key] = Json::array();
    for (const double value : values) list.push_back(number_json(value));
  }
  /// At most `most` numbers.
  void list(const char* key, const std::vector<double>& values, Eigen::Index /*most*/) { numbers(key, values, 0); }
  void counts(const char* key, const std::vector<Eigen::Index>& values, Eigen::Index /*size*/) {
    object_[key] = values;
  }
  /// Gram matrices one after the other, of each the lower triangle, row by row.
  void grams(const char* key, const std::vector<double>& values, const GramShape& shape, Eigen::Index count) {
    Json& list = object_[key] = Json::array();
    for_each_entry(shape, count, [&](Eigen::Index at) { list.push_back(number_json(values[at])); });
  }
  /// fields(archive) takes the fields of a part.
  template <class Fields>
  void part(const char* key, const Fields& fields) {
    StreamWriter archive(object_[key]);
    fields(archive);
  }
  /// A part that is there if `exists`. Returns whether it is.
  template <class Fields>
  bool optional_part(const char* key, bool exists, const Fields& fields) {
    if (exists) part(key, fields);
    return exists;
  }
  /// `count` parts: fields(archive, number).
  template <class Fields>
  void parts(const char* key, Eigen::Index count, const Fields& fields) {
    Json& list = object_[key] = Json::array();
    for (Eigen::Index k = 0; k < count; ++k) {
      StreamWriter archive(list.emplace_back());
      fields(archive, k);
    }
  }

 private:
  Json& object_;
};

/// Sets the values of a part. Throws as JsonReader where a member is missing or has the wrong type, size or range.
class StreamReader {
 public:
  static constexpr bool reads = true;
  explicit StreamReader(const JsonReader& object) : object_(object) {}

  void number(const char* key, double& value) { value = number_from(object_.member(key)); }
  void flag(const char* key, bool& value) {
    int number = 0;
    count(key, number, 0, 1);
    value = number == 1;
  }
  template <class Whole>
  void count(const char* key, Whole& value, int low, std::int64_t high = largest_stream_count) {
    const JsonReader member = object_.member(key);
    const auto read = member.as<std::int64_t>();
    if (read < low || read > high || !std::in_range<Whole>(read)) {
      member.fail(fmt::format("{} is not within {} ... {}", read, low, high));
    }
    value = static_cast<Whole>(read);
  }
  template <class Numbers>
  void numbers(const char* key, Numbers& values, Eigen::Index size) {
    const std::vector<JsonReader> elements = sized(key, size);
    if constexpr (requires { values.resize(size); }) values.resize(size);
    for (Eigen::Index k = 0; k < size; ++k) values[k] = number_from(elements[k]);
  }
  void list(const char* key, std::vector<double>& values, Eigen::Index most) {
    const JsonReader member = object_.member(key);
    if (member.size() > most)
      member.fail(fmt::format("there are {} numbers, at most {} are possible", member.size(), most));
    numbers(key, values, member.size());
  }
  void counts(const char* key, std::vector<Eigen::Index>& values, Eigen::Index size) {
    values.clear();
    for (const JsonReader& element : sized(key, size)) {
      values.push_back(element.as<Eigen::Index>());
      if (values.back() < 0 || values.back() > largest_stream_count) element.fail("it is out of range");
    }
  }
  void grams(const char* key, std::vector<double>& values, const GramShape& shape, Eigen::Index count) {
    const std::vector<JsonReader> elements = sized(key, count * (shape.columns() * (shape.columns() + 1) / 2));
    values.assign(count * shape.size(), 0.0);
    auto next = elements.begin();
    for_each_entry(shape, count, [&](Eigen::Index at) { values[at] = number_from(*next++); });
  }
  template <class Fields>
  void part(const char* key, const Fields& fields) {
    const JsonReader member = object_.member(key);
    StreamReader archive(member);
    fields(archive);
  }
  template <class Fields>
  bool optional_part(const char* key, bool /*exists*/, const Fields& fields) {
    if (!object_.has(key)) return false;
    part(key, fields);
    return true;
  }
  template <class Fields>
  void parts(const char* key, Eigen::Index count, const Fields& fields) {
    const std::vector<JsonReader> elements = sized(key, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      StreamReader archive(elements[k]);
      fields(archive, k);
    }
  }

  const JsonReader& json() const { return object_; }

 private:
  std::vector<JsonReader> sized(const char* key, Eigen::Index size) const {
    const JsonReader member = object_.member(key);
    if (member.size() != size) member.fail(fmt::format("{} elements are needed, there are {}", size, member.size()));
    return member.elements();
  }

  const JsonReader& object_;
};

/// A part as an archive takes it: constant where it is written.
template <class Archive, class Part>
using InArchive = std::conditional_t<Archive::reads, Part, const Part>;

}  // namespace llmt
