// Reading the values of an Arrow file.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "arrow/arrow_parts.hpp"
#include "llmt/limits.hpp"

namespace llmt {

using namespace arrow_file;

namespace {

template <class T>
void copy_numbers(const std::string& bytes, Eigen::Index count, Eigen::Ref<Eigen::VectorXd> to) {
  for (Eigen::Index i = 0; i < count; ++i) {
    T value;
    std::memcpy(&value, bytes.data() + i * static_cast<Eigen::Index>(sizeof value), sizeof value);
    to(i) = static_cast<double>(value);
  }
}

void convert(Numbers numbers, const std::string& bytes, Eigen::Index count, Eigen::Ref<Eigen::VectorXd> to) {
  switch (numbers) {
    case Numbers::int8:
      return copy_numbers<std::int8_t>(bytes, count, to);
    case Numbers::int16:
      return copy_numbers<std::int16_t>(bytes, count, to);
    case Numbers::int32:
      return copy_numbers<std::int32_t>(bytes, count, to);
    case Numbers::int64:
      return copy_numbers<std::int64_t>(bytes, count, to);
    case Numbers::uint8:
      return copy_numbers<std::uint8_t>(bytes, count, to);
    case Numbers::uint16:
      return copy_numbers<std::uint16_t>(bytes, count, to);
    case Numbers::uint32:
      return copy_numbers<std::uint32_t>(bytes, count, to);
    case Numbers::uint64:
      return copy_numbers<std::uint64_t>(bytes, count, to);
    case Numbers::float32:
      return copy_numbers<float>(bytes, count, to);
    default:
      return copy_numbers<double>(bytes, count, to);
  }
}

template <class T>
std::vector<std::int64_t> integers_of_bytes(const std::string& bytes) {
  std::vector<std::int64_t> integers(bytes.size() / sizeof(T));
  for (std::size_t i = 0; i < integers.size(); ++i) {
    T value;
    std::memcpy(&value, bytes.data() + i * sizeof value, sizeof value);
    integers[i] = value;
  }
  return integers;
}

}  // namespace

std::string date_text(std::int64_t count, std::int64_t per_day) {
  const std::int64_t day = count / per_day - (count % per_day < 0 ? 1 : 0);
  const std::int64_t of_day = count - day * per_day;
  constexpr std::chrono::sys_days first = std::chrono::year::min() / 1 / 1;
  constexpr std::chrono::sys_days last = std::chrono::year::max() / 12 / 31;
  std::string text = fmt::format("day {} of 1970", day);
  if (day >= first.time_since_epoch().count() && day <= last.time_since_epoch().count()) {
    const std::chrono::year_month_day date = std::chrono::sys_days(std::chrono::days(day));
    text = fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                       static_cast<unsigned>(date.day()));
  }
  if (of_day == 0) return text;
  const std::int64_t per_second = per_day / 86400;
  const std::int64_t second = of_day / per_second;
  text += fmt::format(" {:02}:{:02}:{:02}", second / 3600, second / 60 % 60, second % 60);
  if (std::int64_t part = of_day % per_second; part > 0) {
    text += '.';
    for (std::int64_t unit = per_second / 10; part > 0; part %= unit, unit /= 10) {
      text += static_cast<char>('0' + part / unit);
    }
  }
  return text;
}

const Column& ArrowTable::Parts::column(const std::string& name) const {
  const auto found = places.find(name);
  if (found == places.end()) fail(fmt::format("there is no column \"{}\"", name));
  return columns[found->second];
}

void ArrowTable::Parts::read_numbers(const Batch& batch, const Column& column, Eigen::Index begin, Eigen::Index end,
                                     Eigen::Ref<Eigen::VectorXd> to) const {
  const auto each = static_cast<std::int64_t>(bytes_of(column.numbers));
  const std::int64_t values = batch.body + batch.buffers[column.first_buffer + 1][0];
  convert(column.numbers, read(values + begin * each, (end - begin) * each), end - begin, to);
  const std::vector<bool> valid = read_valid(batch, column, begin, end);
  for (Eigen::Index i = 0; i < end - begin; ++i) {
    if (!valid[static_cast<std::size_t>(i)]) to(i) = std::numeric_limits<double>::quiet_NaN();
  }
}

std::vector<std::string> ArrowTable::Parts::read_dates(const Batch& batch, const Column& column, Eigen::Index begin,
                                                       Eigen::Index end) const {
  const auto each = static_cast<std::int64_t>(bytes_of(column.numbers));
  const std::int64_t values = batch.body + batch.buffers[column.first_buffer + 1][0];
  const std::string found = read(values + begin * each, (end - begin) * each);
  const std::vector<std::int64_t> counts =
      each == 4 ? integers_of_bytes<std::int32_t>(found) : integers_of_bytes<std::int64_t>(found);
  const std::vector<bool> valid = read_valid(batch, column, begin, end);
  std::vector<std::string> texts(counts.size());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (valid[i]) texts[i] = date_text(counts[i], column.per_day);
  }
  return texts;
}

std::vector<bool> ArrowTable::Parts::read_valid(const Batch& batch, const Column& column, Eigen::Index begin,
                                                Eigen::Index end) const {
  std::vector<bool> valid(static_cast<std::size_t>(end - begin), true);
  if (batch.missing[static_cast<std::size_t>(&column - columns.data())] == 0) return valid;
  const std::int64_t bits = batch.body + batch.buffers[column.first_buffer][0];
  const std::string read_bits = read(bits + begin / 8, (end + 7) / 8 - begin / 8);
  for (Eigen::Index i = begin; i < end; ++i) {
    const auto byte = static_cast<unsigned char>(read_bits[static_cast<std::size_t>(i / 8 - begin / 8)]);
    valid[static_cast<std::size_t>(i - begin)] = (byte >> (i % 8) & 1) != 0;
  }
  return valid;
}

std::vector<std::string> ArrowTable::Parts::read_texts(const Batch& batch, std::size_t buffer, Text text,
                                                       Eigen::Index begin, Eigen::Index end,
                                                       const std::string& column) const {
  std::vector<std::string> texts(static_cast<std::size_t>(end - begin));
  if (texts.empty()) return texts;
  const std::int64_t each = text == Text::small ? 4 : 8;
  const std::string numbers = read(batch.body + batch.buffers[buffer + 1][0] + begin * each, (end - begin + 1) * each);
  const std::vector<std::int64_t> offsets =
      text == Text::small ? integers_of_bytes<std::int32_t>(numbers) : integers_of_bytes<std::int64_t>(numbers);
  if (!std::ranges::is_sorted(offsets) || offsets.front() < 0 || offsets.back() > batch.buffers[buffer + 2][1]) {
    fail(fmt::format("the text of column \"{}\" is damaged", column));
  }
  const std::string all =
      read(batch.body + batch.buffers[buffer + 2][0] + offsets.front(), offsets.back() - offsets.front());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    texts[i] = all.substr(static_cast<std::size_t>(offsets[i] - offsets.front()),
                          static_cast<std::size_t>(offsets[i + 1] - offsets[i]));
  }
  return texts;
}

const std::string& ArrowTable::path() const { return parts_->bytes.name(); }
const std::vector<std::string>& ArrowTable::columns() const { return parts_->names; }
Eigen::Index ArrowTable::rows() const { return parts_->rows; }

bool ArrowTable::has_text(const std::string& column) const {
  const Column& found = parts_->column(column);
  return found.text != Text::none || found.is_date();
}

namespace {

// Calls use(batch, begin, end, first) for the parts of rows first ... first + count - 1 that lie in a batch.
template <class Use>
void for_batches(const ArrowTable::Parts& parts, Eigen::Index first, Eigen::Index count, const Use& use) {
  if (first < 0 || count < 0 || first > parts.rows || count > parts.rows - first) {
    throw std::invalid_argument(
        fmt::format("llmt::ArrowTable: rows {} to {}, the table has {}", first, first + count, parts.rows));
  }
  auto batch = std::ranges::upper_bound(parts.batches, first, {}, &Batch::first);
  if (batch != parts.batches.begin()) --batch;
  for (; batch != parts.batches.end() && batch->first < first + count; ++batch) {
    const Eigen::Index begin = std::max(first, batch->first) - batch->first;
    const Eigen::Index end = std::min(first + count, batch->first + batch->rows) - batch->first;
    if (begin < end) use(*batch, begin, end, batch->first + begin - first);
  }
}

}  // namespace

Eigen::MatrixXd ArrowTable::read(Eigen::Index first, Eigen::Index count, std::span<const std::string> columns) const {
  Eigen::MatrixXd result(std::max<Eigen::Index>(count, 0), std::ssize(columns));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const Column& column = parts_->column(columns[k]);
    if (!column.is_number()) parts_->fail(fmt::format("column \"{}\" holds no numbers", column.name));
    Eigen::Ref<Eigen::VectorXd> to = result.col(static_cast<Eigen::Index>(k));
    for_batches(*parts_, first, count, [&](const Batch& batch, Eigen::Index begin, Eigen::Index end, Eigen::Index at) {
      parts_->read_numbers(batch, column, begin, end, to.segment(at, end - begin));
    });
  }
  return result;
}

std::vector<std::string> ArrowTable::texts(Eigen::Index first, Eigen::Index count, const std::string& name) const {
  const Column& column = parts_->column(name);
  if (!has_text(name)) parts_->fail(fmt::format("column \"{}\" holds no text", column.name));
  std::vector<std::string> result;
  const auto add_from_dictionary = [&](const Batch& batch, Eigen::Index begin, Eigen::Index end, Eigen::Index) {
    const auto dictionary = parts_->dictionaries.find(*column.dictionary);
    const Eigen::Index size = dictionary == parts_->dictionaries.end() ? 0 : std::ssize(dictionary->second.words);
    // A row names a word in a byte: without a limit a small file would be a large table.
    if (size > 0 && std::cmp_greater(dictionary->second.longest, most(Limit::arrow_word))) {
      parts_->fail(fmt::format("column \"{}\" has a word of {} bytes in its dictionary; at most {} are read",
                               column.name, dictionary->second.longest, most(Limit::arrow_word)));
    }
    Eigen::VectorXd places(end - begin);
    parts_->read_numbers(batch, column, begin, end, places);
    for (const double place : places) {
      if (!std::isnan(place) && !(place >= 0.0 && place < static_cast<double>(size))) {
        parts_->fail(fmt::format("column \"{}\" has words that its dictionary has not", column.name));
      }
      result.push_back(std::isnan(place) ? std::string() : dictionary->second.words[static_cast<std::size_t>(place)]);
    }
  };
  const auto add_texts = [&](const Batch& batch, Eigen::Index begin, Eigen::Index end, Eigen::Index) {
    // The text of a missing cell is empty in what all programs write, but need not be.
    std::vector<std::string> texts =
        parts_->read_texts(batch, column.first_buffer, column.text, begin, end, column.name);
    const std::vector<bool> valid = parts_->read_valid(batch, column, begin, end);
    for (std::size_t i = 0; i < texts.size(); ++i) result.push_back(valid[i] ? std::move(texts[i]) : std::string());
  };
  for_batches(*parts_, first, count, [&](const Batch& batch, Eigen::Index begin, Eigen::Index end, Eigen::Index at) {
    if (column.is_date()) {
      for (std::string& text : parts_->read_dates(batch, column, begin, end)) result.push_back(std::move(text));
    } else {
      column.dictionary ? add_from_dictionary(batch, begin, end, at) : add_texts(batch, begin, end, at);
    }
  });
  return result;
}

}  // namespace llmt
