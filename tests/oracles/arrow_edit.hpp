/// \file
/// Edits of the bytes of an Arrow file: places in its metadata, and footers that say what no writer would.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace arrow_edit {

template <class T>
T number(const std::string& bytes, std::size_t at) {
  T value;
  if (at + sizeof value > bytes.size()) throw std::out_of_range("arrow_edit::number");
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

template <class T>
void set(std::string& bytes, std::size_t at, T value) {
  if (at + sizeof value > bytes.size()) throw std::out_of_range("arrow_edit::set");
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// Where a reference of the metadata leads.
inline std::size_t follow(const std::string& bytes, std::size_t at) { return at + number<std::uint32_t>(bytes, at); }

/// Where a field of a table lies. Throws std::out_of_range if it is left out.
inline std::size_t field(const std::string& bytes, std::size_t table, int which) {
  const std::size_t vtable = table - static_cast<std::size_t>(number<std::int32_t>(bytes, table));
  const std::size_t entry = 4 + 2 * static_cast<std::size_t>(which);
  if (entry + 2 > number<std::uint16_t>(bytes, vtable)) throw std::out_of_range("arrow_edit::field");
  const auto offset = number<std::uint16_t>(bytes, vtable + entry);
  if (offset == 0) throw std::out_of_range("arrow_edit::field");
  return table + offset;
}

inline std::size_t table(const std::string& bytes, std::size_t parent, int which) {
  return follow(bytes, field(bytes, parent, which));
}

/// The place of the first entry of a vector; four bytes before it stands how many there are.
inline std::size_t vector(const std::string& bytes, std::size_t parent, int which) {
  return table(bytes, parent, which) + 4;
}

/// Where the length of the footer stands.
inline std::size_t footer_length(const std::string& file) { return file.size() - 10; }

inline std::size_t footer(const std::string& file) {
  const std::size_t end = footer_length(file);
  return follow(file, end - static_cast<std::size_t>(number<std::int32_t>(file, end)));
}

/// The entries of the footer: where each message begins (8 bytes), the length of its metadata (4, and 4 of padding),
/// and that of its body (8).
inline std::size_t batches(const std::string& file) { return vector(file, footer(file), 3); }
inline std::size_t dictionaries(const std::string& file) { return vector(file, footer(file), 2); }

/// The header of the message that an entry names: a batch, or the dictionary around one.
inline std::size_t header(const std::string& file, std::size_t entry) {
  const std::size_t begin = static_cast<std::size_t>(number<std::int64_t>(file, entry)) + 8;
  return table(file, follow(file, begin), 2);
}

/// The field `which` of the schema's column number `column`.
inline std::size_t column_field(const std::string& file, std::size_t column, int which) {
  return field(file, follow(file, vector(file, table(file, footer(file), 1), 1) + 4 * column), which);
}

/// The file with a footer that has `count` batches: the first one again and again.
inline std::string with_repeated_batch(const std::string& file, std::uint32_t count) {
  const std::size_t end = footer_length(file);
  const std::size_t begin = end - static_cast<std::size_t>(number<std::int32_t>(file, end));
  const std::string entry = file.substr(batches(file), 24);
  std::string bytes = file.substr(0, end);
  while ((bytes.size() - begin) % 8 != 4) bytes += '\0';
  const std::size_t place = field(file, footer(file), 3);
  set(bytes, place, static_cast<std::uint32_t>(bytes.size() - place));
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  for (std::uint32_t k = 0; k < count; ++k) bytes += entry;
  const auto length = static_cast<std::int32_t>(bytes.size() - begin);
  bytes.append(reinterpret_cast<const char*>(&length), sizeof length);
  return bytes + "ARROW1";
}

}  // namespace arrow_edit
