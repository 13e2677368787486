/// \file
/// The part of the FlatBuffers format that the metadata of an Arrow file needs: tables, strings and vectors, read with
/// every place checked, and written.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace llmt {

/// A table inside of a buffer of any origin. Every access throws std::runtime_error if it would leave the buffer.
class FlatTable {
 public:
  /// The root of a buffer.
  static FlatTable root(std::string_view buffer) { return {buffer, follow(buffer, 0)}; }

  FlatTable(std::string_view buffer, std::size_t at) : buffer_(buffer), at_(at) {
    const auto back = load<std::int32_t>(buffer, at);
    const std::int64_t vtable = static_cast<std::int64_t>(at) - back;
    if (vtable < 0) fail();
    vtable_ = static_cast<std::size_t>(vtable);
    entries_ = load<std::uint16_t>(buffer, vtable_);
    if (entries_ < 4) fail();
  }

  /// A number, or what it is where the field is left out.
  template <class T>
  T number(int field, T absent) const {
    const std::size_t at = place(field);
    return at == 0 ? absent : load<T>(buffer_, at);
  }

  bool has(int field) const { return place(field) != 0; }

  FlatTable table(int field) const { return {buffer_, follow(buffer_, required(field))}; }

  std::string_view text(int field) const {
    const std::size_t at = follow(buffer_, required(field));
    const std::size_t length = load<std::uint32_t>(buffer_, at);
    check(buffer_, at + 4, length);
    return buffer_.substr(at + 4, length);
  }

  /// Entries of a vector of structs of `size` bytes; none where the field is left out.
  std::vector<std::string_view> structs(int field, std::size_t size) const {
    std::vector<std::string_view> found;
    if (!has(field)) return found;
    const std::size_t at = follow(buffer_, required(field));
    const std::size_t count = load<std::uint32_t>(buffer_, at);
    if (count > buffer_.size() / size) fail();
    check(buffer_, at + 4, count * size);
    for (std::size_t k = 0; k < count; ++k) found.push_back(buffer_.substr(at + 4 + k * size, size));
    return found;
  }

  /// The table that an entry of a vector of references, structs() of four bytes, refers to.
  FlatTable table_at(std::string_view entry) const {
    return {buffer_, follow(buffer_, static_cast<std::size_t>(entry.data() - buffer_.data()))};
  }

  /// A number inside of a struct, or anywhere in a text.
  template <class T>
  static T load(std::string_view buffer, std::size_t at) {
    check(buffer, at, sizeof(T));
    T value;
    std::memcpy(&value, buffer.data() + at, sizeof value);
    return value;
  }

 private:
  [[noreturn]] static void fail() { throw std::runtime_error("the metadata is damaged"); }

  static void check(std::string_view buffer, std::size_t at, std::size_t size) {
    if (at > buffer.size() || size > buffer.size() - at) fail();
  }

  static std::size_t follow(std::string_view buffer, std::size_t at) { return at + load<std::uint32_t>(buffer, at); }

  // Where a field lies; 0: it is left out.
  std::size_t place(int field) const {
    const std::size_t entry = 4 + 2 * static_cast<std::size_t>(field);
    if (entry + 2 > entries_) return 0;
    const auto offset = load<std::uint16_t>(buffer_, vtable_ + entry);
    return offset == 0 ? 0 : at_ + offset;
  }

  std::size_t required(int field) const {
    const std::size_t at = place(field);
    if (at == 0) fail();
    return at;
  }

  std::string_view buffer_;
  std::size_t at_;
  std::size_t vtable_ = 0;
  std::size_t entries_ = 0;
};

/// Writes a buffer from the front: a table first, then what it refers to.
class FlatWriter {
 public:
  FlatWriter() { append<std::uint32_t>(0); }  // where the root lies

  /// A field of a table: its number, size in bytes, and its value; a reference has size 0 and is set later.
  struct Field {
    int number;
    std::size_t size;
    std::int64_t value;
  };

  /// Writes a table and returns the places of its fields, in their order.
  std::vector<std::size_t> table(const std::vector<Field>& fields) {
    int last = -1;
    for (const Field& field : fields) last = std::max(last, field.number);
    const std::size_t entries = 4 + 2 * static_cast<std::size_t>(last + 1);
    align(8);
    while ((bytes_.size() + entries) % 8 != 0) append<std::uint8_t>(0);
    const std::size_t vtable = bytes_.size();
    bytes_.resize(vtable + entries, '\0');
    const std::size_t at = bytes_.size();
    append(static_cast<std::int32_t>(at - vtable));
    std::vector<std::size_t> places;
    for (const Field& field : fields) {
      const std::size_t size = field.size == 0 ? 4 : field.size;
      align(size);
      places.push_back(bytes_.size());
      store(vtable + 4 + 2 * static_cast<std::size_t>(field.number), static_cast<std::uint16_t>(bytes_.size() - at));
      bytes_.append(reinterpret_cast<const char*>(&field.value), size);  // little-endian, as the format
    }
    store(vtable, static_cast<std::uint16_t>(entries));
    store(vtable + 2, static_cast<std::uint16_t>(bytes_.size() - at));
    last_table_ = at;
    return places;
  }

  void root() { store(0, static_cast<std::uint32_t>(last_table_)); }

  /// The reference at `place` is to the table that was written last.
  void refer_to_table(std::size_t place) { refer(place, last_table_); }

  void text(std::size_t place, std::string_view text) {
    align(4);
    refer(place, bytes_.size());
    append(static_cast<std::uint32_t>(text.size()));
    bytes_.append(text).append(1, '\0');
  }

  /// A vector of `count` entries of `size` bytes, of which `content` are the bytes; returns the place of the first.
  std::size_t vector(std::size_t place, std::size_t count, std::string_view content) {
    align(8);
    append<std::uint32_t>(0);  // so that entries of eight bytes lie at multiples of eight
    refer(place, bytes_.size());
    append(static_cast<std::uint32_t>(count));
    bytes_.append(content);
    return bytes_.size() - content.size();
  }

  std::string take() {
    align(8);
    return std::move(bytes_);
  }

 private:
  template <class T>
  void append(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class T>
  void store(std::size_t at, T value) {
    std::memcpy(bytes_.data() + at, &value, sizeof value);
  }
  void align(std::size_t size) {
    while (bytes_.size() % size != 0) bytes_ += '\0';
  }
  void refer(std::size_t place, std::size_t to) { store(place, static_cast<std::uint32_t>(to - place)); }

  std::string bytes_;
  std::size_t last_table_ = 0;
};

}  // namespace llmt
