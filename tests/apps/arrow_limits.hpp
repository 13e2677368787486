// Arrow files at the limits of llmt/limits.hpp.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/program.hpp"
#include "llmt/arrow.hpp"
#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "oracles/arrow_edit.hpp"
#include "oracles/arrow_files.hpp"

namespace arrow_limits {

// A file of one row.
inline std::string file_of(const program::Folder& folder, std::int64_t columns) {
  std::vector<std::string> names;
  for (std::int64_t k = 0; k < columns; ++k) names.push_back(std::to_string(k));
  bool is_given = false;
  llmt::write_arrow(folder.file("t.arrow"), names, [&]() -> std::optional<Eigen::MatrixXd> {
    if (std::exchange(is_given, true)) return std::nullopt;
    return Eigen::MatrixXd::Ones(1, columns);
  });
  return llmt::read_file(folder.file("t.arrow"));
}

// The file of words with another dictionary, whose first word has `length` bytes and the others none.
inline std::string with_word(std::int64_t length) {
  std::string file = arrow_files::words();
  const std::size_t entry = arrow_edit::dictionaries(file);
  const auto at = static_cast<std::size_t>(arrow_edit::number<std::int64_t>(file, entry));
  const auto metadata = static_cast<std::size_t>(arrow_edit::number<std::int32_t>(file, entry + 8));
  const std::size_t batch = arrow_edit::table(file, arrow_edit::header(file, entry), 1);
  const auto words =
      static_cast<std::size_t>(arrow_edit::number<std::int64_t>(file, arrow_edit::field(file, batch, 0)));
  const std::size_t offset_bytes = 4 * (words + 1);
  std::string body(offset_bytes, '\0');
  for (std::size_t k = 1; k <= words; ++k) arrow_edit::set(body, 4 * k, static_cast<std::int32_t>(length));
  body.append(static_cast<std::size_t>(length), 'w');
  // Of each buffer where it begins in the body, and its length: what is missing, the offsets, the text.
  const std::size_t buffers = arrow_edit::vector(file, batch, 2);
  arrow_edit::set<std::int64_t>(file, buffers + 16, 0);
  arrow_edit::set(file, buffers + 24, static_cast<std::int64_t>(offset_bytes));
  arrow_edit::set(file, buffers + 32, static_cast<std::int64_t>(offset_bytes));
  arrow_edit::set(file, buffers + 40, length);
  // The message goes between the batches and the footer.
  const std::size_t end = arrow_edit::footer_length(file);
  const std::size_t footer = end - static_cast<std::size_t>(arrow_edit::number<std::int32_t>(file, end));
  const std::string message = file.substr(at, metadata);
  arrow_edit::set(file, entry, static_cast<std::int64_t>(footer));
  arrow_edit::set(file, entry + 16, static_cast<std::int64_t>(body.size()));
  return file.substr(0, footer) + message + body + file.substr(footer);
}

inline void ask(const program::Folder& folder, llmt::Limit limit, std::int64_t count) {
  std::string file = file_of(folder, limit == llmt::Limit::arrow_columns ? count : 1);
  if (limit == llmt::Limit::arrow_metadata) {
    arrow_edit::set(file, arrow_edit::footer_length(file), static_cast<std::int32_t>(count));
  }
  if (limit == llmt::Limit::arrow_batches) {
    file = arrow_edit::with_repeated_batch(file, static_cast<std::uint32_t>(count));
  }
  if (limit == llmt::Limit::arrow_word) file = with_word(count);
  const llmt::ArrowTable table = llmt::ArrowTable::open(folder.write("t.arrow", file));
  if (limit == llmt::Limit::arrow_word && table.texts(0, 1, "w").front() != std::string(count, 'w')) {
    throw std::runtime_error("another word is read");
  }
}

inline std::string refusal(llmt::Limit limit) {
  if (limit == llmt::Limit::arrow_metadata) return "has a footer of 268435457 bytes; at most 268435456 are read";
  if (limit == llmt::Limit::arrow_columns) return "has 1000001 columns; at most 1000000 are read";
  if (limit == llmt::Limit::arrow_batches) return "has 1000001 batches or dictionaries; at most 1000000 are read";
  return "column \"w\" has a word of 4097 bytes in its dictionary; at most 4096 are read";
}

}  // namespace arrow_limits
