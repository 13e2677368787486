// Writing an Arrow file.
#include "arrow/arrow_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "arrow/arrow_format.hpp"
#include "arrow/flatbuffer.hpp"
#include "base/staged_file.hpp"
#include "llmt/arrow.hpp"
#include "llmt/files.hpp"

namespace llmt {
namespace {

using namespace arrow_format;

static_assert(std::endian::native == std::endian::little);

template <class T>
void append_bytes(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void pad(std::string& bytes, std::size_t size) {
  while (bytes.size() % size != 0) bytes += '\0';
}

// A schema whose table is referred to at `place`.
void write_schema(FlatWriter& writer, std::size_t place, const std::vector<std::string>& columns) {
  const std::size_t fields = writer.table({{schema::fields, 0, 0}}).front();
  writer.refer_to_table(place);
  const std::size_t first = writer.vector(fields, columns.size(), std::string(4 * columns.size(), '\0'));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const std::vector<std::size_t> places = writer.table({{field::name, 0, 0},
                                                          {field::nullable, 1, 1},
                                                          {field::type_type, 1, type::floating},
                                                          {field::type, 0, 0},
                                                          {field::children, 0, 0}});
    writer.refer_to_table(first + 4 * k);
    writer.text(places[0], columns[k]);
    writer.table({{type::precision, 2, type::double_precision}});
    writer.refer_to_table(places[3]);
    writer.vector(places[4], 0, "");
  }
}

// A message behind its length, with the padding that the format asks for.
std::string message_bytes(FlatWriter& writer) {
  const std::string content = writer.take();
  std::string bytes;
  append_bytes(bytes, continuation);
  append_bytes(bytes, static_cast<std::int32_t>(content.size()));
  return bytes + content;
}

std::size_t begin_message(FlatWriter& writer, std::uint8_t header_type, std::int64_t body_length) {
  const std::vector<std::size_t> places = writer.table({{message::version, 2, version_5},
                                                        {message::header_type, 1, header_type},
                                                        {message::header, 0, 0},
                                                        {message::body_length, 8, body_length}});
  writer.root();
  return places[2];
}

// Missing values and numbers of the columns of a batch, and where they lie in the body.
struct Body {
  std::string nodes;
  std::string buffers;
  std::string bytes;
};

Body body_of(const Eigen::Ref<const Eigen::MatrixXd>& rows) {
  Body body;
  const auto add_buffer = [&](const std::string& content) {
    append_bytes(body.buffers, static_cast<std::int64_t>(body.bytes.size()));
    append_bytes(body.buffers, static_cast<std::int64_t>(content.size()));
    body.bytes += content;
    pad(body.bytes, 64);
  };
  for (Eigen::Index j = 0; j < rows.cols(); ++j) {
    const Eigen::VectorXd column = rows.col(j);
    const Eigen::Index missing = column.array().isNaN().count();
    std::string valid;
    if (missing > 0) {
      valid.assign((column.size() + 7) / 8, '\0');
      for (Eigen::Index i = 0; i < column.size(); ++i) {
        if (!std::isnan(column(i))) valid[i / 8] = static_cast<char>(valid[i / 8] | (1 << (i % 8)));
      }
    }
    append_bytes(body.nodes, static_cast<std::int64_t>(column.size()));
    append_bytes(body.nodes, static_cast<std::int64_t>(missing));
    add_buffer(valid);
    add_buffer(
        {reinterpret_cast<const char*>(column.data()), static_cast<std::size_t>(column.size()) * sizeof(double)});
  }
  return body;
}

// Passes the file on in pieces and knows where it is.
class ArrowWriter {
 public:
  ArrowWriter(const TextSink& sink, const std::vector<std::string>& columns) : sink_(sink), columns_(columns) {
    write(std::string(magic) + std::string(2, '\0'));
    FlatWriter writer;
    write_schema(writer, begin_message(writer, message::is_schema, 0), columns);
    write(message_bytes(writer));
  }

  void write_batch(const Eigen::Ref<const Eigen::MatrixXd>& rows) {
    const Body body = body_of(rows);
    FlatWriter writer;
    const std::size_t header = begin_message(writer, message::is_batch, std::ssize(body.bytes));
    const std::vector<std::size_t> places =
        writer.table({{batch::length, 8, rows.rows()}, {batch::nodes, 0, 0}, {batch::buffers, 0, 0}});
    writer.refer_to_table(header);
    writer.vector(places[1], body.nodes.size() / 16, body.nodes);
    writer.vector(places[2], body.buffers.size() / 16, body.buffers);
    std::string bytes = message_bytes(writer);
    append_bytes(blocks_, position_);
    append_bytes(blocks_, static_cast<std::int64_t>(bytes.size()));  // four bytes, and four of padding
    append_bytes(blocks_, static_cast<std::int64_t>(body.bytes.size()));
    write(bytes);
    write(body.bytes);
    rows_ += rows.rows();
  }

  Eigen::Index finish() {
    std::string end;
    append_bytes(end, continuation);
    append_bytes(end, std::int32_t{0});
    write(end);
    FlatWriter writer;
    const std::vector<std::size_t> places =
        writer.table({{footer::version, 2, version_5}, {footer::schema, 0, 0}, {footer::batches, 0, 0}});
    writer.root();
    write_schema(writer, places[1], columns_);
    writer.vector(places[2], blocks_.size() / 24, blocks_);
    std::string bytes = writer.take();
    append_bytes(bytes, static_cast<std::int32_t>(bytes.size()));
    write(bytes + std::string(magic));
    return rows_;
  }

 private:
  void write(const std::string& bytes) {
    sink_(bytes);
    position_ += std::ssize(bytes);
  }

  const TextSink& sink_;
  const std::vector<std::string>& columns_;
  std::int64_t position_ = 0;
  std::string blocks_;
  Eigen::Index rows_ = 0;
};

// Passes an Arrow file on in pieces. Returns the number of rows.
Eigen::Index pass_rows(const TextSink& sink, const std::vector<std::string>& columns, const NextRows& next) {
  ArrowWriter writer(sink, columns);
  const Eigen::Index most = arrow_rows_at_once(columns.size());
  Eigen::MatrixXd waiting(0, std::ssize(columns));  // grows: a table of few rows takes no room for many
  Eigen::Index filled = 0;
  while (const std::optional<Eigen::MatrixXd> given = next()) {
    if (given->cols() != std::ssize(columns)) {
      throw std::invalid_argument(
          fmt::format("llmt::write_arrow: rows have {} columns, there are {} names", given->cols(), columns.size()));
    }
    for (Eigen::Index done = 0; done < given->rows();) {
      const Eigen::Index count = std::min(given->rows() - done, most - filled);
      if (filled + count > waiting.rows()) {
        waiting.conservativeResize(std::min(most, std::max(filled + count, 2 * waiting.rows())), Eigen::NoChange);
      }
      waiting.middleRows(filled, count) = given->middleRows(done, count);
      done += count;
      filled += count;
      if (filled < most) continue;
      writer.write_batch(waiting);
      filled = 0;
    }
  }
  if (filled > 0) writer.write_batch(waiting.topRows(filled));
  return writer.finish();
}

void check_columns(const std::vector<std::string>& columns) {
  if (columns.empty()) throw std::invalid_argument("llmt::write_arrow: there is no column");
  if (std::set<std::string>(columns.begin(), columns.end()).size() < columns.size()) {
    throw std::invalid_argument("llmt::write_arrow: two columns have the same name");
  }
}

}  // namespace

Eigen::Index arrow_rows_at_once(std::size_t columns) {
  constexpr std::size_t most_rows = 65536;
  constexpr std::size_t most_cells = std::size_t{1} << 24;
  return static_cast<Eigen::Index>(
      std::clamp<std::size_t>(most_cells / std::max<std::size_t>(columns, 1), 1, most_rows));
}

Eigen::Index write_arrow(const std::string& path, const std::vector<std::string>& columns, const NextRows& next) {
  check_columns(columns);
  Eigen::Index rows = 0;
  write_file(path, [&](const TextSink& sink) { rows = pass_rows(sink, columns, next); });
  return rows;
}

TableBytes held_rows(const std::string& name, const std::vector<std::string>& columns, const NextRows& next) {
  check_columns(columns);
  const char* const asked = std::getenv("TMPDIR");
  const std::filesystem::path folder = asked == nullptr || *asked == '\0' ? "/tmp" : asked;
  const auto fail = [&] {
    const int error = errno;
    throw std::runtime_error(fmt::format(
        "{}: its rows cannot be kept in {}, the folder for temporary files (TMPDIR): {}{}", name, folder.string(),
        std::strerror(error), error == EMFILE ? "; llmt table makes one file of them" : ""));
  };
  Descriptor file = temporary_file(folder);
  if (!file.is_open()) fail();
  pass_rows([&](std::string_view piece) { write_all(file, piece) ? void() : fail(); }, columns, next);
  return {name, std::move(file)};
}

}  // namespace llmt
