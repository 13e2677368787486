#include "python/bindings/arrow_cells.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "llmt/arrow.hpp"

namespace llmt::python {
namespace {

using Kind = CellType::Kind;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

[[noreturn]] void refuse(const std::string& column, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: the Arrow data are broken: {}", column, what));
}

// The element `i` of a buffer that need not be aligned.
template <class T>
T element(const void* buffer, std::int64_t i) {
  T value;
  std::memcpy(&value, static_cast<const char*>(buffer) + i * static_cast<std::int64_t>(sizeof(T)), sizeof(T));
  return value;
}

double half(std::uint16_t bits) {
  const int exponent = (bits >> 10) & 0x1f;
  const int fraction = bits & 0x3ff;
  const double sign = (bits & 0x8000) != 0 ? -1.0 : 1.0;
  if (exponent == 0) return sign * std::ldexp(fraction, -24);
  if (exponent == 31) return fraction != 0 ? missing : sign * std::numeric_limits<double>::infinity();
  return sign * std::ldexp(1024 + fraction, exponent - 25);
}

// The float64 that is nearest to digits * 10^-scale, as a CSV reader takes it.
double scaled(bool is_negative, std::string_view digits, int scale) {
  const std::string text = fmt::format("{}e{}", digits, -scale);
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range) {
    value = scale < 0 ? std::numeric_limits<double>::infinity() : 0.0;
  }
  return is_negative ? -value : value;
}

// A decimal is a whole number in two's complement, the lowest byte first.
double decimal(const void* buffer, std::int64_t i, int bytes, int scale) {
  const char* const at = static_cast<const char*>(buffer) + i * bytes;
  std::array<std::uint32_t, 8> limbs = {};
  const int count = bytes / 4;
  std::memcpy(limbs.data(), at, bytes);  // as bytes lie in memory where the lowest comes first
  const bool is_negative = (limbs[count - 1] >> 31) != 0;
  if (is_negative) {
    std::uint64_t carry = 1;
    for (int k = 0; k < count; ++k) {
      carry += static_cast<std::uint32_t>(~limbs[k]);
      limbs[k] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
  }
  std::array<char, 81> digits = {};  // 2^256 has 78
  std::size_t begin = digits.size();
  for (bool is_zero = false; !is_zero;) {
    std::uint64_t rest = 0;
    is_zero = true;
    for (int k = count - 1; k >= 0; --k) {
      rest = (rest << 32) | limbs[k];
      limbs[k] = static_cast<std::uint32_t>(rest / 1000000000);
      rest %= 1000000000;
      is_zero = is_zero && limbs[k] == 0;
    }
    for (int k = 0; k < 9; ++k, rest /= 10) digits[--begin] = static_cast<char>('0' + rest % 10);
  }
  return scaled(is_negative, std::string_view(digits.data() + begin, digits.size() - begin), scale);
}

template <class T>
auto plain(const void* buffer) {
  return [buffer](std::int64_t i) { return static_cast<double>(element<T>(buffer, i)); };
}

// Calls `use(read)` with what reads the cell at a position of the buffers as a number.
template <class Use>
void with_numbers(const ArrowArray& array, const CellType& type, Use&& use) {
  const void* const values = type.kind == Kind::null ? nullptr : array.buffers[1];
  const bool is_signed = type.kind == Kind::integer;
  switch (type.kind) {
    case Kind::boolean:
      return use([values](std::int64_t i) { return bit(values, i) ? 1.0 : 0.0; });
    case Kind::decimal:
      return use([values, &type](std::int64_t i) { return decimal(values, i, type.bytes, type.scale); });
    case Kind::floating:
      if (type.bytes == 2) return use([values](std::int64_t i) { return half(element<std::uint16_t>(values, i)); });
      return type.bytes == 4 ? use(plain<float>(values)) : use(plain<double>(values));
    case Kind::integer:
    case Kind::unsigned_integer:
      switch (type.bytes) {
        case 1:
          return is_signed ? use(plain<std::int8_t>(values)) : use(plain<std::uint8_t>(values));
        case 2:
          return is_signed ? use(plain<std::int16_t>(values)) : use(plain<std::uint16_t>(values));
        case 4:
          return is_signed ? use(plain<std::int32_t>(values)) : use(plain<std::uint32_t>(values));
        default:
          return is_signed ? use(plain<std::int64_t>(values)) : use(plain<std::uint64_t>(values));
      }
    default:
      return use([](std::int64_t) { return missing; });
  }
}

template <class Offset>
std::string_view text(const ArrowArray& array, std::int64_t i, const std::string& column) {
  const auto begin = element<Offset>(array.buffers[1], i);
  const auto end = element<Offset>(array.buffers[1], i + 1);
  if (begin < 0 || end < begin) refuse(column, fmt::format("a text begins at {} and ends at {}", begin, end));
  if (begin == end) return {};
  if (array.buffers[2] == nullptr) refuse(column, "there is no buffer of characters");
  return {static_cast<const char*>(array.buffers[2]) + begin, static_cast<std::size_t>(end - begin)};
}

std::string_view text_view(const ArrowArray& array, std::int64_t i, const std::string& column) {
  constexpr std::int32_t most_inline = 12;
  const char* const view = static_cast<const char*>(array.buffers[1]) + i * 16;
  const auto length = element<std::int32_t>(view, 0);
  if (length < 0) refuse(column, fmt::format("a text has the length {}", length));
  if (length <= most_inline) return {view + 4, static_cast<std::size_t>(length)};
  const auto buffer = element<std::int32_t>(view, 2);
  const auto offset = element<std::int32_t>(view, 3);
  const std::int64_t buffers = array.n_buffers - 3;
  if (buffer < 0 || buffer >= buffers) refuse(column, fmt::format("a text is in buffer {} of {}", buffer, buffers));
  const void* const sizes = array.buffers[array.n_buffers - 1];
  const void* const characters = array.buffers[2 + buffer];
  if (sizes == nullptr || characters == nullptr) refuse(column, "there is no buffer of characters");
  const auto size = element<std::int64_t>(sizes, buffer);
  if (offset < 0 || length > size - offset) {
    refuse(column, fmt::format("a text of {} bytes at {} is in a buffer of {}", length, offset, size));
  }
  return {static_cast<const char*>(characters) + offset, static_cast<std::size_t>(length)};
}

std::string_view text_at(const ArrowArray& array, const CellType& type, std::int64_t i, const std::string& column) {
  switch (type.kind) {
    case Kind::text:
      return text<std::int32_t>(array, i, column);
    case Kind::large_text:
      return text<std::int64_t>(array, i, column);
    default:
      return text_view(array, i, column);
  }
}

// Writes the cells `first` ... of an array, whose own offset is added here.
template <class Read>
void fill(const ArrowArray& array, std::int64_t first, std::int64_t rows, double* out, Read&& read) {
  const void* const valid = array.n_buffers > 0 ? array.buffers[0] : nullptr;
  const std::int64_t begin = array.offset + first;
  for (std::int64_t i = 0; i < rows; ++i) {
    out[i] = valid == nullptr || bit(valid, begin + i) ? read(begin + i) : missing;
  }
}

void read_values(const ArrowArray& array, const CellType& type, std::int64_t first, std::int64_t rows,
                 const std::string& column, Words& words, double* out) {
  if (type.kind == Kind::date) {
    const void* const counts = array.buffers[1];
    fill(array, first, rows, out, [&](std::int64_t i) {
      const std::int64_t count = type.bytes == 4 ? element<std::int32_t>(counts, i) : element<std::int64_t>(counts, i);
      return words.position_of_date(count, type.per_day);
    });
  } else if (type.is_text()) {
    fill(array, first, rows, out, [&](std::int64_t i) { return words.position_of(text_at(array, type, i, column)); });
  } else {
    with_numbers(array, type, [&](auto read) { fill(array, first, rows, out, read); });
  }
}

// Indices become the dictionary's values. Values that no cell has are not looked at.
void read_dictionary(const ArrowArray& array, const CellType& type, std::int64_t first, std::int64_t rows,
                     const std::string& column, Words& words, double* out) {
  const ArrowArray& dictionary = *array.dictionary;
  CellType values = type;
  values.is_dictionary = false;
  const CellType indices{type.index_is_signed ? Kind::integer : Kind::unsigned_integer, type.index_bytes};
  with_numbers(array, indices, [&](auto read) {
    fill(array, first, rows, out, [&](std::int64_t i) {
      const double index = read(i);  // not exact from 2^53 on, where no dictionary has values
      if (index < 0.0 || index >= static_cast<double>(dictionary.length)) {
        refuse(column, fmt::format("index {} of a dictionary with {} values", index, dictionary.length));
      }
      double value = missing;
      read_values(dictionary, values, static_cast<std::int64_t>(index), 1, column, words, &value);
      return value;
    });
  });
}

}  // namespace

double Words::position_of(std::string_view word) {
  const auto [found, is_new] = positions.try_emplace(word, static_cast<double>(in_order.size()));
  if (is_new) in_order.push_back(word);
  return found->second;
}

double Words::position_of_date(std::int64_t count, std::int64_t per_day) {
  const auto [found, is_new] = dates.try_emplace(count, 0.0);
  if (is_new) found->second = position_of(made.emplace_back(date_text(count, per_day)));
  return found->second;
}

void require_cells(const ArrowArray& array, const CellType& type, std::int64_t first, std::int64_t rows,
                   const std::string& column) {
  constexpr std::int64_t most = std::int64_t{1} << 56;  // so that sums and sizes in bytes do not overflow
  if (array.release == nullptr) refuse(column, "an array has been released");
  if (array.length < 0 || array.offset < 0 || array.length > most || array.offset > most || rows > most) {
    refuse(column, fmt::format("an array has the length {} and the offset {}", array.length, array.offset));
  }
  if (first + rows > array.length) {
    refuse(column, fmt::format("an array has {} rows where {} are needed", array.length, first + rows));
  }
  const std::int64_t needed = type.buffers();
  const bool has_views = type.kind == Kind::text_view && !type.is_dictionary;
  const bool has_bitmap_of_null = needed == 0 && array.n_buffers == 1;  // of producers before Arrow 1.0
  if (has_views ? array.n_buffers < needed : array.n_buffers != needed && !has_bitmap_of_null) {
    refuse(column, fmt::format("an array has {} buffers where {} are needed", array.n_buffers, needed));
  }
  if (array.n_children != 0) refuse(column, "an array of plain cells has children");
  if ((array.dictionary != nullptr) != type.is_dictionary) refuse(column, "array and schema differ in a dictionary");
  if (array.n_buffers > 0 && array.buffers == nullptr) refuse(column, "an array has no buffers");
  if (needed > 0 && array.buffers[0] == nullptr && array.null_count > 0) {
    refuse(column, fmt::format("{} cells are missing, and no bitmap says which", array.null_count));
  }
  if (needed > 1 && array.buffers[1] == nullptr && rows > 0) refuse(column, "an array has rows and no values");
  if (!type.is_dictionary) return;
  CellType values = type;
  values.is_dictionary = false;
  if (array.dictionary->length > std::int64_t{1} << 40) refuse(column, "the dictionary has more than 2^40 values");
  require_cells(*array.dictionary, values, 0, array.dictionary->length, column);
}

void read_cells(const ArrowArray& array, const CellType& type, std::int64_t first, std::int64_t rows,
                const std::string& column, Words& words, double* out) {
  if (rows == 0) return;
  if (type.is_dictionary) {
    read_dictionary(array, type, first, rows, column, words, out);
  } else {
    read_values(array, type, first, rows, column, words, out);
  }
}

}  // namespace llmt::python
