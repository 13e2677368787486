// Reading an Arrow file. Parts are read when they are asked for, by number of byte: a file that somebody cuts off
// meanwhile is an error, where mapped memory would end the program.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string_view>

#include "arrow/arrow_format.hpp"
#include "arrow/flatbuffer.hpp"
#include "base/descriptor.hpp"
#include "llmt/arrow.hpp"

namespace llmt {

// Not in an anonymous namespace, for ArrowTable::Parts has members of these types.
namespace arrow_file {

// What the values of a column are; only its first buffers matter where they are no numbers.
enum class Numbers { none, int8, int16, int32, int64, uint8, uint16, uint32, uint64, float32, float64 };

struct Column {
  std::string name;
  Numbers numbers = Numbers::none;
  std::size_t buffers = 2;
};

struct Batch {
  Eigen::Index first = 0;  // row
  Eigen::Index rows = 0;
  std::int64_t body = 0;                             // where it begins in the file
  std::vector<std::int64_t> missing;                 // of every column
  std::vector<std::array<std::int64_t, 2>> buffers;  // offset in the body, and length
};

}  // namespace arrow_file

namespace {

using namespace arrow_file;

using namespace arrow_format;

constexpr std::int64_t largest_metadata = std::int64_t{1} << 28;

std::size_t bytes_of(Numbers numbers) {
  switch (numbers) {
    case Numbers::none:
      return 0;
    case Numbers::int8:
    case Numbers::uint8:
      return 1;
    case Numbers::int16:
    case Numbers::uint16:
      return 2;
    case Numbers::int32:
    case Numbers::uint32:
    case Numbers::float32:
      return 4;
    default:
      return 8;
  }
}

Numbers numbers_of(const FlatTable& field, std::uint8_t kind) {
  if (field.has(field::dictionary)) return Numbers::none;
  if (kind == type::floating) {
    const auto precision = field.table(field::type).number<std::int16_t>(type::precision, 0);
    if (precision == type::single_precision) return Numbers::float32;
    return precision == type::double_precision ? Numbers::float64 : Numbers::none;
  }
  if (kind != type::integer) return Numbers::none;
  const FlatTable described = field.table(field::type);
  const bool is_signed = described.number<std::uint8_t>(type::is_signed, 0) != 0;
  switch (described.number<std::int32_t>(type::bit_width, 0)) {
    case 8:
      return is_signed ? Numbers::int8 : Numbers::uint8;
    case 16:
      return is_signed ? Numbers::int16 : Numbers::uint16;
    case 32:
      return is_signed ? Numbers::int32 : Numbers::uint32;
    case 64:
      return is_signed ? Numbers::int64 : Numbers::uint64;
    default:
      throw std::runtime_error("the metadata is damaged");
  }
}

// Buffers of a flat column of a type, by its number in Schema.fbs. Throws for nested types.
std::size_t buffers_of(std::uint8_t kind, const std::string& name) {
  constexpr std::array<int, 22> counts = {-1, 0, 2, 2, 3, 3, 2, 2, 2, 2, 2, 2, -1, -1, -1, 2, -1, -1, 2, 3, 3, -1};
  if (kind >= counts.size() || counts[kind] < 0) {
    throw std::runtime_error(fmt::format("column \"{}\" is nested or of an unknown type; write flat columns", name));
  }
  return static_cast<std::size_t>(counts[kind]);
}

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

}  // namespace

struct ArrowTable::Parts {
  std::string path;
  Descriptor file;
  std::int64_t size = 0;
  std::vector<Column> columns;
  std::vector<std::string> names;
  std::vector<Batch> batches;
  Eigen::Index rows = 0;

  [[noreturn]] void fail(const std::string& why) const { throw std::runtime_error(fmt::format("{}: {}", path, why)); }

  std::string read(std::int64_t at, std::int64_t count) const {
    if (at < 0 || count < 0 || at > size || count > size - at) fail("a part lies outside of the file; it is cut off");
    std::string bytes(static_cast<std::size_t>(count), '\0');
    for (std::int64_t done = 0; done < count;) {
      const ssize_t got =
          ::pread(file.number(), bytes.data() + done, static_cast<std::size_t>(count - done), at + done);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) fail(fmt::format("cannot be read: {}", std::strerror(errno)));
      if (got == 0) fail("became shorter while it was read");
      done += got;
    }
    return bytes;
  }

  void read_schema(const FlatTable& schema);
  void read_batch(std::string_view block);
  void read_all();
};

void ArrowTable::Parts::read_schema(const FlatTable& schema) {
  if (schema.number<std::int16_t>(schema::endianness, 0) != 0) fail("is big-endian");
  for (const FlatTable& field : schema.tables(schema::fields)) {
    Column column;
    column.name = field.has(field::name) ? std::string(field.text(field::name)) : std::string();
    const auto kind = field.number<std::uint8_t>(field::type_type, 0);
    column.numbers = numbers_of(field, kind);
    column.buffers = field.has(field::dictionary) ? 2 : buffers_of(kind, column.name);
    if (std::ranges::find(names, column.name) != names.end()) fail(fmt::format("two columns \"{}\"", column.name));
    names.push_back(column.name);
    columns.push_back(std::move(column));
  }
  if (columns.empty()) fail("has no column");
}

void ArrowTable::Parts::read_batch(std::string_view block) {
  const auto offset = FlatTable::load<std::int64_t>(block, 0);
  const auto metadata = FlatTable::load<std::int32_t>(block, 8);
  const auto body_length = FlatTable::load<std::int64_t>(block, 16);
  if (metadata < 8 || metadata > largest_metadata) fail("a batch has metadata of an impossible length");
  const std::string bytes = read(offset, metadata);
  // Before version 1.0 there was no mark before the length.
  const bool has_mark = FlatTable::load<std::uint32_t>(bytes, 0) == continuation;
  const FlatTable message = FlatTable::root(std::string_view(bytes).substr(has_mark ? 8 : 4));
  if (message.number<std::uint8_t>(message::header_type, 0) != message::is_batch) fail("a batch of rows is none");
  const FlatTable header = message.table(message::header);
  if (header.has(batch::compression)) fail("is compressed; write it without compression");
  Batch result;
  result.first = rows;
  result.rows = header.number<std::int64_t>(batch::length, 0);
  result.body = offset + metadata;
  if (body_length < 0 || result.body > size || body_length > size - result.body) {
    fail("a batch lies outside of the file; it is cut off");
  }
  const std::vector<std::string_view> nodes = header.structs(batch::nodes, 16);
  if (result.rows < 0 || nodes.size() != columns.size()) fail("a batch does not have the columns of the file");
  for (const std::string_view node : nodes) {
    if (FlatTable::load<std::int64_t>(node, 0) != result.rows) fail("columns of a batch have different lengths");
    result.missing.push_back(FlatTable::load<std::int64_t>(node, 8));
  }
  for (const std::string_view buffer : header.structs(batch::buffers, 16)) {
    const auto begin = FlatTable::load<std::int64_t>(buffer, 0);
    const auto length = FlatTable::load<std::int64_t>(buffer, 8);
    if (begin < 0 || length < 0 || begin > body_length || length > body_length - begin) {
      fail("a column lies outside of its batch");
    }
    result.buffers.push_back({begin, length});
  }
  std::size_t first = 0;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    const Column& column = columns[j];
    if (first + column.buffers > result.buffers.size()) fail("a batch does not have the columns of the file");
    const std::size_t bytes_each = bytes_of(column.numbers);
    if (bytes_each > 0) {
      const auto values = static_cast<std::uint64_t>(result.buffers[first + 1][1]);
      const auto valid = static_cast<std::uint64_t>(result.buffers[first][1]);
      const auto wanted = static_cast<std::uint64_t>(result.rows);
      if (values / bytes_each < wanted || (result.missing[j] != 0 && valid < wanted / 8 + (wanted % 8 != 0 ? 1 : 0))) {
        fail(fmt::format("column \"{}\" of a batch is shorter than its {} rows", column.name, result.rows));
      }
    }
    first += column.buffers;
  }
  if (result.rows > std::numeric_limits<Eigen::Index>::max() - rows) fail("has more rows than can be counted");
  rows += result.rows;
  if (result.rows > 0) batches.push_back(std::move(result));
}

void ArrowTable::Parts::read_all() {
  constexpr auto magic_size = static_cast<std::int64_t>(magic.size());
  constexpr std::int64_t tail = 4 + magic_size;
  if (size < 8 + tail || read(0, magic_size) != magic) fail("is no Arrow file");
  const std::string end = read(size - tail, tail);
  if (end.substr(4) != magic) fail("has no end: it is cut off, or an Arrow stream, which must be written as a file");
  const auto length = FlatTable::load<std::int32_t>(end, 0);
  if (length < 8 || length > largest_metadata || length > size - tail - 8) fail("has a footer of an impossible length");
  const std::string bytes = read(size - tail - length, length);
  const FlatTable footer = FlatTable::root(bytes);
  if (footer.number<std::int16_t>(footer::version, 0) < version_5 - 1) fail("is older than metadata version 4");
  read_schema(footer.table(footer::schema));
  for (const std::string_view block : footer.structs(footer::batches, 24)) read_batch(block);
}

ArrowTable ArrowTable::open(const std::string& path) {
  auto parts = std::make_shared<Parts>();
  parts->path = path;
  parts->file = Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (!parts->file.is_open() || ::fstat(parts->file.number(), &status) != 0) {
    parts->fail(fmt::format("cannot be read: {}", std::strerror(errno)));
  }
  if (!S_ISREG(status.st_mode)) parts->fail("is no regular file");
  parts->size = status.st_size;
  try {
    parts->read_all();
  } catch (const std::runtime_error& error) {
    const std::string_view message = error.what();
    if (message.starts_with(path + ": ")) throw;
    parts->fail(error.what());
  }
  ArrowTable table;
  table.parts_ = std::move(parts);
  return table;
}

const std::string& ArrowTable::path() const { return parts_->path; }
const std::vector<std::string>& ArrowTable::columns() const { return parts_->names; }
Eigen::Index ArrowTable::rows() const { return parts_->rows; }

Eigen::MatrixXd ArrowTable::read(Eigen::Index first, Eigen::Index count, std::span<const std::string> columns) const {
  const Parts& parts = *parts_;
  if (first < 0 || count < 0 || first > parts.rows || count > parts.rows - first) {
    throw std::invalid_argument(
        fmt::format("llmt::ArrowTable::read: rows {} to {}, the table has {}", first, first + count, parts.rows));
  }
  Eigen::MatrixXd result(count, std::ssize(columns));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const auto found = std::ranges::find(parts.names, columns[k]);
    if (found == parts.names.end()) {
      parts.fail(fmt::format("there is no column \"{}\"", columns[k]));
    }
    const auto at = static_cast<std::size_t>(found - parts.names.begin());
    const Column& column = parts.columns[at];
    const auto size = static_cast<std::int64_t>(bytes_of(column.numbers));
    if (size == 0) parts.fail(fmt::format("column \"{}\" holds no numbers", column.name));
    std::size_t buffer = 0;
    for (std::size_t j = 0; j < at; ++j) buffer += parts.columns[j].buffers;
    auto batch = std::ranges::upper_bound(parts.batches, first, {}, &Batch::first);
    if (batch != parts.batches.begin()) --batch;
    for (; batch != parts.batches.end() && batch->first < first + count; ++batch) {
      const Eigen::Index begin = std::max(first, batch->first) - batch->first;
      const Eigen::Index end = std::min(first + count, batch->first + batch->rows) - batch->first;
      if (begin >= end) continue;
      Eigen::Ref<Eigen::VectorXd> to =
          result.col(static_cast<Eigen::Index>(k)).segment(batch->first + begin - first, end - begin);
      const std::int64_t values = batch->body + batch->buffers[buffer + 1][0];
      convert(column.numbers, parts.read(values + begin * size, (end - begin) * size), end - begin, to);
      if (batch->missing[at] == 0) continue;
      const std::int64_t bits = batch->body + batch->buffers[buffer][0];
      const std::string valid = parts.read(bits + begin / 8, (end + 7) / 8 - begin / 8);
      for (Eigen::Index i = begin; i < end; ++i) {
        const bool is_valid = (static_cast<unsigned char>(valid[i / 8 - begin / 8]) >> (i % 8) & 1) != 0;
        if (!is_valid) to(i - begin) = std::numeric_limits<double>::quiet_NaN();
      }
    }
  }
  return result;
}

bool is_arrow_file(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return false;
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  std::array<char, magic.size()> begin{};
  return file.is_open() && ::pread(file.number(), begin.data(), begin.size(), 0) == std::ssize(begin) &&
         std::string_view(begin.data(), begin.size()) == magic;
}

}  // namespace llmt
