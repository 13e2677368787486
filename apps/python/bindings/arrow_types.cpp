#include "python/bindings/arrow_types.hpp"

#include <fmt/format.h>
#include <nanobind/nanobind.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace llmt::python {
namespace {

using Kind = CellType::Kind;

constexpr const char* from_time = "convert it to numbers, such as days since a first date, or leave it out";
constexpr const char* from_parts = "make columns of its parts, or leave it out";
constexpr const char* from_other = "convert it to numbers or text, or leave it out";

struct Refused {
  std::string_view begin;  // of the format
  const char* words;
  const char* advice;
};

// The first beginning that fits counts.
constexpr std::array<Refused, 21> refused = {{
    {"tt", "times of day", from_time},
    {"tD", "durations", "convert it to numbers, such as seconds, or leave it out"},
    {"ti", "calendar intervals", from_time},
    {"z", "bytes (binary)", "decode it to text, or leave it out"},
    {"Z", "bytes (large binary)", "decode it to text, or leave it out"},
    {"vz", "bytes (binary view)", "decode it to text, or leave it out"},
    {"w:", "bytes (binary of fixed size)", "decode it to text, or leave it out"},
    {"+l", "lists", from_parts},
    {"+L", "lists (large)", from_parts},
    {"+vl", "lists (list view)", from_parts},
    {"+vL", "lists (large list view)", from_parts},
    {"+w:", "lists (of fixed size)", from_parts},
    {"+s", "structs", from_parts},
    {"+m", "maps", from_parts},
    {"+ud:", "unions (dense)", from_parts},
    {"+us:", "unions (sparse)", from_parts},
    {"+r", "run-end encoded values", "decode it (pyarrow.compute.run_end_decode), or leave it out"},
    {"_pli128", "integers of 128 bits", "cast it to Float64 or text, or leave it out"},
    {"_plu128", "integers of 128 bits", "cast it to Float64 or text, or leave it out"},
    {"+", "nested values", from_parts},
    {"", "values of an unknown type", from_other},
}};

[[noreturn]] void refuse(const std::string& column, const std::string& words, std::string_view format,
                         const char* advice) {
  throw nanobind::type_error(fmt::format("{} holds {} (Arrow format '{}'): {}", column, words, format, advice).c_str());
}

// Whole numbers between commas: "19,10,128" behind "d:".
std::optional<std::array<int, 3>> decimal_of(std::string_view text) {
  std::array<int, 3> result = {0, 0, 128};  // precision, scale, bits
  const char* const end = text.data() + text.size();
  const char* at = text.data();
  for (std::size_t i = 0; i < result.size(); ++i) {
    const auto [stop, error] = std::from_chars(at, end, result[i]);
    if (error != std::errc()) return std::nullopt;
    if (stop == end) return i > 0 ? std::optional(result) : std::nullopt;
    if (*stop != ',') return std::nullopt;
    at = stop + 1;
  }
  return std::nullopt;
}

// Days and milliseconds, and moments of any unit, whatever their zone: they count from 1970 in UTC.
std::optional<CellType> date_type(std::string_view format) {
  constexpr std::int64_t seconds = 86'400;
  if (format == "tdD") return CellType{.kind = Kind::date, .bytes = 4, .per_day = 1};
  if (format == "tdm") return CellType{.kind = Kind::date, .bytes = 8, .per_day = seconds * 1000};
  if (!format.starts_with("ts") || format.size() < 4 || format[3] != ':') return std::nullopt;
  constexpr std::string_view units = "smun";
  const std::size_t unit = units.find(format[2]);
  if (unit == std::string_view::npos) return std::nullopt;
  constexpr std::array<std::int64_t, 4> per_second = {1, 1000, 1'000'000, 1'000'000'000};
  return CellType{.kind = Kind::date, .bytes = 8, .per_day = seconds * per_second[unit]};
}

std::optional<CellType> simple_type(std::string_view format) {
  if (format == "n") return CellType{Kind::null};
  if (format == "b") return CellType{Kind::boolean};
  if (format == "u") return CellType{Kind::text};
  if (format == "U") return CellType{Kind::large_text};
  if (format == "vu") return CellType{Kind::text_view};
  if (format.size() == 1) {
    constexpr std::string_view integers = "csil";
    constexpr std::string_view floats = "efg";  // of 2, 4 and 8 bytes
    const char lower = static_cast<char>(format[0] | 0x20);
    if (const std::size_t at = integers.find(lower); at != std::string_view::npos) {
      return CellType{format[0] == lower ? Kind::integer : Kind::unsigned_integer, 1 << at};
    }
    if (const std::size_t at = floats.find(format[0]); at != std::string_view::npos) {
      return CellType{Kind::floating, 2 << at};
    }
  }
  if (format.starts_with("d:")) {
    const auto parts = decimal_of(format.substr(2));
    constexpr int largest_scale = 10000;
    if (!parts || std::abs((*parts)[1]) > largest_scale) return std::nullopt;
    const int bits = (*parts)[2];
    if (bits == 32 || bits == 64 || bits == 128 || bits == 256) return CellType{Kind::decimal, bits / 8, (*parts)[1]};
  }
  return std::nullopt;
}

// The name of an extension type; empty if the field has none.
std::string extension_of(const ArrowSchema& schema) {
  if (schema.metadata == nullptr) return "";
  const char* at = schema.metadata;
  const auto number = [&] {
    std::int32_t value = 0;
    std::memcpy(&value, at, sizeof value);
    at += sizeof value;
    if (value < 0) throw std::runtime_error("the metadata of an Arrow schema has a negative length");
    return value;
  };
  const auto text = [&] {
    const std::int32_t length = number();
    return std::string_view(std::exchange(at, at + length), length);
  };
  for (std::int32_t pairs = number(); pairs > 0; --pairs) {
    const std::string_view key = text();
    const std::string_view value = text();
    if (key == "ARROW:extension:name") return std::string(value);
  }
  return "";
}

CellType value_type(const ArrowSchema& schema, const std::string& column, const std::string& of) {
  if (schema.format == nullptr) throw std::runtime_error(fmt::format("{}: the Arrow schema has no format", column));
  const std::string_view format = schema.format;
  if (const std::string extension = extension_of(schema); !extension.empty()) {
    refuse(column, fmt::format("{}values of the extension type {}", of, extension), format,
           "take its storage or convert it to numbers or text, or leave it out");
  }
  if (const auto type = simple_type(format)) return *type;
  if (const auto type = date_type(format)) return *type;
  const auto* found =
      std::ranges::find_if(refused, [&](const Refused& type) { return format.starts_with(type.begin); });
  refuse(column, of + found->words, format, found->advice);
}

}  // namespace

std::int64_t CellType::buffers() const {
  if (is_dictionary) return 2;
  switch (kind) {
    case Kind::null:
      return 0;
    case Kind::text:
    case Kind::large_text:
    case Kind::text_view:
      return 3;
    default:
      return 2;
  }
}

CellType cell_type(const ArrowSchema& schema, const std::string& column) {
  const CellType type = value_type(schema, column, "");
  if (schema.dictionary == nullptr) return type;
  if (type.kind != Kind::integer && type.kind != Kind::unsigned_integer) {
    throw std::runtime_error(
        fmt::format("{}: the indices of an Arrow dictionary must be whole numbers, their format "
                    "is '{}'",
                    column, schema.format));
  }
  if (schema.dictionary->dictionary != nullptr) {
    refuse(column, "a dictionary of a dictionary", schema.format, from_other);
  }
  CellType values = value_type(*schema.dictionary, column, "a dictionary of ");
  values.is_dictionary = true;
  values.index_bytes = type.bytes;
  values.index_is_signed = type.kind == Kind::integer;
  return values;
}

}  // namespace llmt::python
