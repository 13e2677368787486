#include "llmt/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/memory.hpp"
#include "csv/cells.hpp"
#include "llmt/files.hpp"
#include "llmt/names.hpp"

namespace llmt {
namespace {

std::string_view between(const char* begin, const char* end) { return {begin, static_cast<std::size_t>(end - begin)}; }

// The most that the text of a table may take: the other half is for its numbers.
std::uintmax_t half_of_memory() { return machine_memory() / 2; }

// The first of these that the header has, outside quotes or inside.
char separator_of(std::string_view header, DecimalMark mark) {
  for (const char candidate : mark == DecimalMark::comma ? std::string_view(";\t") : std::string_view(",;\t")) {
    if (header.find(candidate) != std::string_view::npos) return candidate;
  }
  return ',';
}

// Tables of other programs that are no text, by their first bytes.
void refuse_binary_tables(const std::string& name, std::string_view bytes) {
  struct Kind {
    std::string_view begin;
    const char* what;
  };
  static constexpr std::array<Kind, 3> kinds = {Kind{"\xFF\xFF\xFF\xFF", "an Arrow stream"},
                                                {{"FEA1\0", 5}, "a Feather file of version 1"},
                                                {"PAR1\x15", "a Parquet file"}};
  for (const Kind& kind : kinds) {
    if (!bytes.starts_with(kind.begin)) continue;
    throw std::runtime_error(
        fmt::format("{}: this is {}, a table of text or an uncompressed Arrow file is needed; in Python "
                    "pyarrow.feather.write_feather(table, path, compression=\"uncompressed\") writes one",
                    name, kind.what));
  }
}

}  // namespace

Csv Csv::read(const std::string& path, DecimalMark mark) {
  return parse(read_file(path, {.bytes = half_of_memory(), .line_bytes = csv::longest_record}), path, mark);
}

Csv Csv::parse(std::string text, std::string name, DecimalMark mark) {
  Csv csv;
  csv.mark_ = mark;
  csv.name_ = std::move(name);
  csv.text_ = std::move(text);
  csv.read_header();
  csv.find_rows();
  return csv;
}

void Csv::read_header() {
  header_begin_ = csv::header_begin(text_);
  if (header_begin_ >= text_.size()) {
    throw EmptyText(fmt::format("{}: the file is empty, a header row is needed", name_));
  }
  const std::string_view header = header_text();
  const char* const end = header.data() + header.size();
  if (header.starts_with("ARROW1")) {
    throw std::runtime_error(fmt::format(
        "{}: this is an Arrow file, a table of text is needed; llmt fit and llmt predict read both", name_));
  }
  refuse_binary_tables(name_, std::string_view(text_).substr(header_begin_));
  if (header.starts_with("\xFF\xFE") || header.starts_with("\xFE\xFF") || header.find('\0') != std::string_view::npos) {
    throw std::runtime_error(fmt::format("{}: this is UTF-16 or no text at all, UTF-8 is needed", name_));
  }
  refuse_header_of_other_programs(header);
  separator_ = separator_of(header, mark_);
  for (const char* begin = header.data();;) {
    const char* const field_end = csv::field_end(begin, end, separator_);
    std::string column = csv::unquoted(between(begin, field_end));
    if (column.empty()) {
      throw std::runtime_error(fmt::format("{}:{}: column {} of the header has no name", name_, line_at(header_begin_),
                                           columns_.size() + 1));
    }
    if (const std::string byte = csv::byte_not_utf8(column); !byte.empty()) {
      throw EncodingError(fmt::format("{}:{}: {} of the name of column {} of the header is not UTF-8", name_,
                                      line_at(header_begin_), byte, columns_.size() + 1));
    }
    if (!fields_.emplace(column, columns_.size()).second) {
      throw std::runtime_error(
          fmt::format("{}:{}: the header has column \"{}\" twice", name_, line_at(header_begin_), column));
    }
    columns_.push_back(std::move(column));
    if (field_end == end) return;
    begin = field_end + 1;
  }
}

// A first line that is none of a table, and line ends that would make one line of the whole table.
void Csv::refuse_header_of_other_programs(std::string_view header) const {
  const auto refuse_header = [&](const char* why) {
    throw std::runtime_error(fmt::format("{}:{}: {}", name_, line_at(header_begin_), why));
  };
  const std::string_view bare = header.substr(0, header.find_last_not_of(" \t\r") + 1);
  if (bare.starts_with("sep=") && bare.size() <= 5) {
    refuse_header("a line that names the separator of a spreadsheet is no header: delete it");
  }
  const bool is_all = !rows_precede_ && std::string_view(text_).find_first_not_of(
                                            " \t\r\n", header_begin_ + header.size()) == std::string_view::npos;
  if (is_all && !more_follows_ && std::ranges::count(header, '"') % 2 != 0) {
    refuse_header("a quote is left open: the rest of the file would be the header");
  }
  if (!is_all || more_follows_) return;
  for (std::size_t at = header.find('\r'); at != std::string_view::npos; at = header.find('\r', at + 1)) {
    // Within quotes a line may end with CRLF, and elsewhere CR is a blank.
    if (at + 1 == header.size() || std::string_view("\r\n \t,;").find(header[at + 1]) != std::string_view::npos)
      continue;
    refuse_header("lines end with CR alone, LF or CRLF is needed: tr '\\r' '\\n' converts such files");
  }
  for (const std::string_view end : {"\f", "\v", "\xC2\x85", "\xE2\x80\xA8", "\xE2\x80\xA9"}) {
    if (header.find(end) != std::string_view::npos) {
      refuse_header("lines end with a form feed or a separator of Unicode, LF or CRLF is needed");
    }
  }
}

void Csv::find_rows() {
  const char* const text = text_.data();
  const char* const end = text + text_.size();
  const auto after = [&](const csv::Record& record) { return record.end == end ? end : record.end + 1; };
  for (const char* begin = after(csv::record_at(text + header_begin_, end, separator_)); begin != end;) {
    const csv::Record record = csv::record_at(begin, end, separator_);
    if (!csv::is_blank(between(begin, record.end))) {
      row_begins_.push_back(begin - text);
      if (record.fields != columns_.size()) {
        const bool is_last =
            !more_follows_ && between(record.end, end).find_first_not_of(" \t\r\n") == std::string_view::npos;
        const bool is_comment = row_begins_.size() == 1 && !rows_precede_ && header_text().starts_with('#');
        throw std::runtime_error(
            fmt::format("{}:{}: the row has {} field{}, the header has {}{}", name_, line_at(row_begins_.back()),
                        record.fields, record.fields == 1 ? "" : "s", columns_.size(),
                        is_comment ? "; the first line must be the header, delete comments above it"
                        : is_last && record.fields < columns_.size() ? " (is the file cut off?)"
                                                                     : ""));
      }
    }
    begin = after(record);
  }
}

std::size_t Csv::index_of(std::string_view column) const {
  const auto found = fields_.find(column);
  if (found == fields_.end()) {
    const auto whole = std::ranges::find_if(columns_, [&](const std::string& name) {
      return !column.empty() && name.find(',') != std::string::npos && name.find(column) != std::string::npos;
    });
    const std::string hint =
        whole == columns_.end() ? did_you_mean(column, columns_)
                                : fmt::format(" (a name with a comma is given in its quotes: '{}')", csv_field(*whole));
    throw std::runtime_error(
        fmt::format("{}: there is no column \"{}\"{}; the columns are {}", name_, column, hint, csv_row(columns_)));
  }
  return found->second;
}

void Csv::refuse(Eigen::Index row, std::string_view column, const std::string& reason) const {
  throw std::runtime_error(fmt::format("{}:{}: column \"{}\": {}", name_, line_of(row), column, reason));
}

std::string_view Csv::row_text(Eigen::Index row) const { return record_text(row_begins_[row]); }

std::string_view Csv::header_text() const { return record_text(header_begin_); }

Eigen::Index Csv::line_of(Eigen::Index row) const { return line_at(row_begins_[row]); }

std::vector<Eigen::Index> Csv::lines_of(std::span<const Eigen::Index> rows) const {
  std::vector<Eigen::Index> lines;
  Eigen::Index line = 1 + lines_left_out_;
  auto counted = text_.begin();
  for (const Eigen::Index row : rows) {
    const auto begin = text_.begin() + row_begins_[row];
    line += std::count(counted, begin, '\n');
    lines.push_back(line);
    counted = begin;
  }
  return lines;
}

Csv Csv::with_rows(std::span<const Eigen::Index> rows) const {
  Csv part = *this;
  part.row_begins_.clear();
  for (const Eigen::Index row : rows) part.row_begins_.push_back(row_begins_[row]);
  return part;
}

Eigen::Index Csv::line_at(std::size_t offset) const {
  return 1 + lines_left_out_ + std::count(text_.begin(), text_.begin() + offset, '\n');
}

// The record at `begin` without its line end.
std::string_view Csv::record_text(std::size_t begin) const {
  const char* const end = text_.data() + text_.size();
  const std::string_view text =
      between(text_.data() + begin, csv::record_at(text_.data() + begin, end, separator_).end);
  return text.ends_with('\r') ? text.substr(0, text.size() - 1) : text;
}

std::string csv_field(std::string_view text, char separator) {
  if (text.find_first_of("\"\r\n") == std::string_view::npos && text.find(separator) == std::string_view::npos) {
    return std::string(text);
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c;
    if (c == '"') {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string csv_row(std::span<const std::string> fields) {
  std::string row;
  for (const std::string& field : fields) row += (row.empty() ? "" : ", ") + csv_field(field);
  return row;
}

}  // namespace llmt
