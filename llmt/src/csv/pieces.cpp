#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <istream>
#include <stdexcept>

#include "csv/cells.hpp"
#include "llmt/csv.hpp"

namespace llmt {
namespace {

// How much of `text` is whole records.
std::size_t whole_records(const std::string& text) {
  const char* const end = text.data() + text.size();
  const char* begin = text.data();
  // Fields are not asked for, so any separator will do.
  for (csv::Record record = csv::record_at(begin, end, ','); record.end != end;
       record = csv::record_at(begin, end, ',')) {
    begin = record.end + 1;
  }
  return begin - text.data();
}

}  // namespace

CsvPieces::CsvPieces(std::istream& input, std::string name, std::size_t bytes, DecimalMark mark)
    : input_(input), name_(std::move(name)), bytes_(std::max<std::size_t>(bytes, 1)), mark_(mark) {}

std::optional<Csv> CsvPieces::next() {
  for (;;) {
    // What is left of the last piece begins a record; more of it is read until one ends.
    std::size_t whole = 0;
    while (whole == 0 && input_) {
      const std::size_t old = pending_.size();
      if (old > csv::longest_record) {
        throw std::runtime_error(
            fmt::format("{}:{}: no row ends within 16 MiB (is a quote left open?)", name_, lines_ + 1));
      }
      const std::size_t more = std::max(bytes_, old);
      pending_.resize(old + more);
      errno = 0;
      input_.read(pending_.data() + old, static_cast<std::streamsize>(more));
      pending_.resize(old + input_.gcount());
      if (input_.bad()) {
        throw std::runtime_error(fmt::format("{}: cannot be read: {}", name_, std::strerror(errno != 0 ? errno : EIO)));
      }
      whole = input_ ? whole_records(pending_) : pending_.size();
    }
    const bool last = !input_;
    const std::string rows = pending_.substr(0, whole);
    pending_.erase(0, whole);
    if (rows.empty() && !header_.empty()) return std::nullopt;
    if (header_.empty() && !last && csv::header_begin(rows) == rows.size()) {
      lines_ += std::ranges::count(rows, '\n');
      continue;  // blank lines before the header
    }
    Csv csv;
    csv.name_ = name_;
    csv.mark_ = mark_;
    csv.rows_precede_ = has_given_rows_;
    csv.more_follows_ = !last;
    csv.text_ = header_ + rows;
    csv.lines_left_out_ = lines_ - std::ranges::count(header_, '\n');
    lines_ += std::ranges::count(rows, '\n');
    csv.read_header();
    csv.find_rows();
    if (header_.empty()) {
      header_ = std::string(csv.header_text()) + '\n';
    }
    has_given_rows_ = has_given_rows_ || csv.rows() > 0;
    if (csv.rows() > 0) return csv;
  }
}

}  // namespace llmt
