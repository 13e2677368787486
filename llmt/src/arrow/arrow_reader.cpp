// Opening an Arrow file: what its metadata say.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "arrow/arrow_format.hpp"
#include "arrow/arrow_parts.hpp"
#include "arrow/arrow_writer.hpp"
#include "arrow/flatbuffer.hpp"
#include "llmt/arrow.hpp"
#include "llmt/limits.hpp"

namespace llmt {

namespace {

using namespace arrow_file;

using namespace arrow_format;

// The numbers that an Int table describes.
Numbers integers_of(const FlatTable& described) {
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

Numbers numbers_of(const FlatTable& field, std::uint8_t kind) {
  if (kind == type::floating) {
    const auto precision = field.table(field::type).number<std::int16_t>(type::precision, 0);
    if (precision == type::single_precision) return Numbers::float32;
    return precision == type::double_precision ? Numbers::float64 : Numbers::none;
  }
  return kind == type::integer ? integers_of(field.table(field::type)) : Numbers::none;
}

// How many units a day has of a column that counts days, or parts of a day, from 1970-01-01; 0: it is no such column.
std::int64_t units_per_day(const FlatTable& field, std::uint8_t kind) {
  if (kind != type::date && kind != type::moment) return 0;
  const bool is_moment = kind == type::moment;
  const auto unit = field.table(field::type).number<std::int16_t>(type::unit, is_moment ? 0 : 1);
  constexpr std::array<std::int64_t, 2> of_date = {1, 86'400'000};
  constexpr std::array<std::int64_t, 4> of_moment = {86'400, 86'400'000, 86'400'000'000, 86'400'000'000'000};
  const std::size_t known = is_moment ? of_moment.size() : of_date.size();
  if (unit < 0 || std::cmp_greater_equal(unit, known)) throw std::runtime_error("the metadata is damaged");
  return is_moment ? of_moment[static_cast<std::size_t>(unit)] : of_date[static_cast<std::size_t>(unit)];
}

Text text_of(std::uint8_t kind) {
  if (kind == type::text) return Text::small;
  return kind == type::large_text ? Text::large : Text::none;
}

// Buffers of a flat column of a type, by its number in Schema.fbs. Throws for nested types.
std::size_t buffers_of(std::uint8_t kind, const std::string& name) {
  constexpr std::array<int, 22> counts = {-1, 0, 2, 2, 3, 3, 2, 2, 2, 2, 2, 2, -1, -1, -1, 2, -1, -1, 2, 3, 3, -1};
  if (kind >= counts.size() || counts[kind] < 0) {
    throw std::runtime_error(fmt::format("column \"{}\" is nested or of an unknown type; write flat columns", name));
  }
  return static_cast<std::size_t>(counts[kind]);
}

}  // namespace

void ArrowTable::Parts::read_schema(const FlatTable& schema, std::size_t most_bytes) {
  if (schema.number<std::int16_t>(schema::endianness, 0) != 0) fail("is big-endian");
  const std::vector<std::string_view> fields = schema.structs(schema::fields, 4);
  if (std::ssize(fields) > most(Limit::arrow_columns))
    fail(fmt::format("has {} columns; at most {} are read", fields.size(), most(Limit::arrow_columns)));
  std::size_t bytes_of_names = 0;
  std::size_t buffers = 0;
  for (const std::string_view reference : fields) {
    const FlatTable field = schema.table_at(reference);
    Column column;
    column.name = field.has(field::name) ? std::string(field.text(field::name)) : std::string();
    // Names that lie in each other would be more text than the file has.
    bytes_of_names += column.name.size();
    if (bytes_of_names > most_bytes) fail("the metadata is damaged: names of columns overlap");
    const auto kind = field.number<std::uint8_t>(field::type_type, 0);
    column.text = text_of(kind);
    if (field.has(field::dictionary)) {
      const FlatTable encoding = field.table(field::dictionary);
      column.dictionary = encoding.number<std::int64_t>(dictionary::id, 0);
      dictionary_columns.emplace(*column.dictionary, columns.size());
      column.numbers =
          encoding.has(dictionary::index_type) ? integers_of(encoding.table(dictionary::index_type)) : Numbers::int32;
    } else {
      column.per_day = units_per_day(field, kind);
      column.numbers = column.per_day == 0   ? numbers_of(field, kind)
                       : column.per_day == 1 ? Numbers::int32
                                             : Numbers::int64;
      column.buffers = buffers_of(kind, column.name);
    }
    column.first_buffer = buffers;
    buffers += column.buffers;
    if (!places.emplace(column.name, columns.size()).second) fail(fmt::format("two columns \"{}\"", column.name));
    names.push_back(column.name);
    columns.push_back(std::move(column));
  }
  if (columns.empty()) fail("has no column");
}

namespace {

// A message of the file: where its body lies, and its header.
struct Message {
  std::string metadata;
  std::int64_t body = 0;
  std::int64_t body_length = 0;

  // Before version 1.0 there was no mark before the length.
  FlatTable root() const {
    const bool has_mark = FlatTable::load<std::uint32_t>(metadata, 0) == continuation;
    return FlatTable::root(std::string_view(metadata).substr(has_mark ? 8 : 4));
  }
};

Message read_message(const ArrowTable::Parts& parts, const Block& block) {
  return {parts.read(block.begin, block.metadata), block.begin + block.metadata, block.body};
}

// Where the messages lie that an entry of the footer lists.
void add_blocks(const ArrowTable::Parts& parts, const FlatTable& footer, int entry, const char* what,
                std::vector<Block>& blocks) {
  const std::vector<std::string_view> given = footer.structs(entry, 24);
  if (std::ssize(given) > most(Limit::arrow_batches)) {
    parts.fail(fmt::format("has {} batches or dictionaries; at most {} are read, write longer batches", given.size(),
                           most(Limit::arrow_batches)));
  }
  for (std::size_t k = 0; k < given.size(); ++k) {
    const Block block{FlatTable::load<std::int64_t>(given[k], 0), FlatTable::load<std::int32_t>(given[k], 8),
                      FlatTable::load<std::int64_t>(given[k], 16), fmt::format("{} {}", what, k + 1)};
    if (block.metadata < 8) parts.fail(fmt::format("{} has metadata of an impossible length", block.name));
    if (block.metadata > most(Limit::arrow_metadata)) {
      parts.fail(fmt::format("{} has {} bytes of metadata; at most {} are read", block.name, block.metadata,
                             most(Limit::arrow_metadata)));
    }
    if (block.begin < 0 || block.body < 0 || block.begin > parts.size || block.metadata > parts.size - block.begin ||
        block.body > parts.size - block.begin - block.metadata) {
      parts.fail(fmt::format("{} lies outside of the file; it is cut off", block.name));
    }
    blocks.push_back(block);
  }
}

// Refuses a file that names the same bytes several times: it would be a larger table than it has bytes.
void refuse_overlap(const ArrowTable::Parts& parts, const std::vector<Block>& blocks) {
  std::vector<const Block*> order;
  for (const Block& block : blocks) order.push_back(&block);
  std::ranges::stable_sort(order, {}, &Block::begin);
  for (std::size_t k = 1; k < order.size(); ++k) {
    const Block& before = *order[k - 1];
    if (order[k]->begin >= before.begin + before.metadata + before.body) continue;
    parts.fail(fmt::format("{} and {} overlap", before.name, order[k]->name));
  }
}

// The same for the buffers of a message.
void refuse_overlap(const ArrowTable::Parts& parts, const Batch& batch, const std::string& name) {
  std::vector<std::array<std::int64_t, 2>> order;
  for (const std::array<std::int64_t, 2>& buffer : batch.buffers) {
    if (buffer[1] > 0) order.push_back(buffer);
  }
  std::ranges::sort(order);
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (order[k][0] < order[k - 1][0] + order[k - 1][1]) parts.fail(fmt::format("columns of {} overlap", name));
  }
}

// Columns of a batch of rows, or the one of a dictionary.
Batch batch_of(const ArrowTable::Parts& parts, const Message& message, const FlatTable& header, std::size_t columns,
               const std::string& name) {
  if (header.has(batch::compression)) parts.fail("is compressed; write it without compression");
  Batch result;
  result.rows = header.number<std::int64_t>(batch::length, 0);
  result.body = message.body;
  const std::vector<std::string_view> nodes = header.structs(batch::nodes, 16);
  if (result.rows < 0 || nodes.size() != columns)
    parts.fail(fmt::format("{} does not have the columns of the file", name));
  if (result.rows / 8 + (result.rows % 8 != 0 ? 1 : 0) > message.body_length) {  // a row has at least a bit
    parts.fail(fmt::format("{} has {} rows in {} bytes", name, result.rows, message.body_length));
  }
  for (const std::string_view node : nodes) {
    if (FlatTable::load<std::int64_t>(node, 0) != result.rows) {
      parts.fail(fmt::format("columns of {} have different lengths", name));
    }
    result.missing.push_back(FlatTable::load<std::int64_t>(node, 8));
  }
  for (const std::string_view buffer : header.structs(batch::buffers, 16)) {
    const auto begin = FlatTable::load<std::int64_t>(buffer, 0);
    const auto length = FlatTable::load<std::int64_t>(buffer, 8);
    if (begin < 0 || length < 0 || begin > message.body_length || length > message.body_length - begin) {
      parts.fail(fmt::format("a column lies outside of {}", name));
    }
    result.buffers.push_back({begin, length});
  }
  refuse_overlap(parts, result, name);
  return result;
}

// Refuses buffers that are shorter than rows of `bytes_each` bytes, or of text, whose offsets are one more.
void check_lengths(const ArrowTable::Parts& parts, const Batch& batch, std::size_t first, std::size_t bytes_each,
                   bool has_offsets, std::int64_t missing, const std::string& column) {
  const auto values = static_cast<std::uint64_t>(batch.buffers[first + 1][1]) / bytes_each;
  const auto valid = static_cast<std::uint64_t>(batch.buffers[first][1]);
  const auto rows = static_cast<std::uint64_t>(batch.rows);
  const bool is_empty = rows == 0 && values == 0;  // then the one offset may be left out
  if ((values < rows + (has_offsets ? 1 : 0) && !is_empty) ||
      (missing != 0 && valid < rows / 8 + (rows % 8 != 0 ? 1 : 0))) {
    parts.fail(fmt::format("column \"{}\" of a batch is shorter than its {} rows", column, rows));
  }
}

}  // namespace

void ArrowTable::Parts::read_dictionary(const Block& block) {
  const Message message = read_message(*this, block);
  const FlatTable root = message.root();
  if (root.number<std::uint8_t>(message::header_type, 0) != message::is_dictionary) fail("a dictionary is none");
  const FlatTable header = root.table(message::header);
  const auto id = header.number<std::int64_t>(dictionary_batch::id, 0);
  const auto place = dictionary_columns.find(id);
  if (place == dictionary_columns.end() || columns[place->second].text == Text::none) return;
  const Column& column = columns[place->second];
  const Batch batch = batch_of(*this, message, header.table(dictionary_batch::data), 1, block.name);
  if (batch.buffers.size() < 3) fail(fmt::format("the dictionary of column \"{}\" is damaged", column.name));
  check_lengths(*this, batch, 0, column.text == Text::small ? 4 : 8, true, batch.missing.front(), column.name);
  const bool is_delta = header.number<std::uint8_t>(dictionary_batch::is_delta, 0) != 0;
  Dictionary& dictionary = dictionaries[id];
  if (!is_delta && !dictionary.words.empty()) fail(fmt::format("column \"{}\" has two dictionaries", column.name));
  for (std::string& word : read_texts(batch, 0, column.text, 0, batch.rows, column.name)) {
    dictionary.longest = std::max(dictionary.longest, word.size());
    dictionary.words.push_back(std::move(word));
  }
}

void ArrowTable::Parts::read_batch(const Block& block) {
  const Message message = read_message(*this, block);
  const FlatTable root = message.root();
  if (root.number<std::uint8_t>(message::header_type, 0) != message::is_batch) fail("a batch of rows is none");
  Batch result = batch_of(*this, message, root.table(message::header), columns.size(), block.name);
  result.first = rows;
  if (columns.back().first_buffer + columns.back().buffers > result.buffers.size()) {
    fail(fmt::format("{} does not have the columns of the file", block.name));
  }
  for (std::size_t j = 0; j < columns.size(); ++j) {
    const Column& column = columns[j];
    const bool has_offsets = column.text != Text::none && !column.dictionary;
    const std::size_t bytes_each = has_offsets ? (column.text == Text::small ? 4 : 8) : bytes_of(column.numbers);
    if (bytes_each > 0) {
      check_lengths(*this, result, column.first_buffer, bytes_each, has_offsets, result.missing[j], column.name);
    }
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
  if (end.substr(4) != magic) fail("has no end; it is cut off");
  const auto length = FlatTable::load<std::int32_t>(end, 0);
  if (length > most(Limit::arrow_metadata))
    fail(fmt::format("has a footer of {} bytes; at most {} are read", length, most(Limit::arrow_metadata)));
  if (length < 8 || length > size - tail - 8) fail("has a footer of an impossible length");
  const std::string footer_bytes = read(size - tail - length, length);
  const FlatTable footer = FlatTable::root(footer_bytes);
  if (footer.number<std::int16_t>(footer::version, 0) < version_5 - 1) fail("is older than metadata version 4");
  read_schema(footer.table(footer::schema), footer_bytes.size());
  std::vector<Block> blocks;
  add_blocks(*this, footer, footer::dictionaries, "dictionary", blocks);
  const std::size_t dictionary_blocks = blocks.size();
  add_blocks(*this, footer, footer::batches, "batch", blocks);
  refuse_overlap(*this, blocks);
  for (std::size_t k = 0; k < blocks.size(); ++k)
    k < dictionary_blocks ? read_dictionary(blocks[k]) : read_batch(blocks[k]);
}

namespace {

std::shared_ptr<const ArrowTable::Parts> parts_of(TableBytes bytes) {
  auto parts = std::make_shared<ArrowTable::Parts>(std::move(bytes));
  try {
    parts->read_all();
  } catch (const std::runtime_error& error) {
    const std::string_view message = error.what();
    if (message.starts_with(parts->bytes.name() + ": ")) throw;
    parts->fail(error.what());
  }
  parts->bytes.release_if_many();
  return parts;
}

}  // namespace

ArrowTable ArrowTable::open(const std::string& path) {
  ArrowTable table;
  table.parts_ = parts_of(TableBytes(path));
  return table;
}

ArrowTable ArrowTable::hold(const std::string& name, const std::vector<std::string>& columns, const NextRows& next) {
  ArrowTable table;
  table.parts_ = parts_of(held_rows(name, columns, next));
  return table;
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
