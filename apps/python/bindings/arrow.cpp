// Tables through the Arrow C data and stream interfaces: of polars, pyarrow, DuckDB and others, without any of them.

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <unistd.h>

#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/arrow.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/arrow_abi.hpp"
#include "python/bindings/arrow_cells.hpp"
#include "python/bindings/arrow_types.hpp"
#include "python/bindings/interruptible.hpp"
#include "python/bindings/module.hpp"

namespace llmt::python {
namespace {

using Schema = Owned<ArrowSchema>;
using Chunk = Owned<ArrowArray>;
using RowStream = Owned<ArrowArrayStream>;

// Takes the structure out of a capsule, which is then empty.
template <class Struct>
Owned<Struct> taken(const nb::object& capsule, const char* name) {
  auto* const held = static_cast<Struct*>(PyCapsule_GetPointer(capsule.ptr(), name));
  if (held == nullptr) throw nb::python_error();
  if (held->release == nullptr) throw std::runtime_error(fmt::format("the capsule {} has been read already", name));
  return Owned<Struct>(held);
}

// A text of UTF-8, or nothing.
std::optional<nb::str> decoded(std::string_view text) {
  PyObject* const result = PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), nullptr);
  if (result == nullptr) {
    PyErr_Clear();
    return std::nullopt;
  }
  return nb::steal<nb::str>(result);
}

// Any text, for people.
std::string legible(const char* text) {
  const auto size = static_cast<Py_ssize_t>(std::strlen(text));
  const nb::object result = nb::steal(PyUnicode_DecodeUTF8(text, size, "replace"));
  if (!result.is_valid()) throw nb::python_error();
  return nb::cast<std::string>(result);
}

// Throws what a call into the stream's producer reports by an error number that is not 0.
void require_success(RowStream& stream, int error, const char* call) {
  if (error == 0) return;
  const char* const why = stream->get_last_error == nullptr ? nullptr : stream->get_last_error(stream.get());
  throw std::runtime_error(
      fmt::format("the Arrow stream failed in {}: {}", call, why == nullptr ? std::strerror(error) : legible(why)));
}

// The producer may wait for other threads that need the interpreter's lock.
Schema schema_of(RowStream& stream) {
  if (stream->get_schema == nullptr || stream->get_next == nullptr) {
    throw std::runtime_error("the Arrow stream has no functions");
  }
  Schema schema;
  int error = 0;
  {
    const nb::gil_scoped_release unlocked;
    error = stream->get_schema(stream.get(), schema.get());
  }
  require_success(stream, error, "get_schema");
  return schema;
}

std::vector<Chunk> chunks_of(RowStream& stream) {
  std::vector<Chunk> chunks;
  while (true) {
    check_signals();
    Chunk chunk;
    int error = 0;
    {
      const nb::gil_scoped_release unlocked;
      error = stream->get_next(stream.get(), chunk.get());
    }
    require_success(stream, error, "get_next");
    if (chunk.empty()) return chunks;
    if (chunk->length != 0) chunks.push_back(std::move(chunk));
  }
}

struct ColumnOfTable {
  nb::str name;
  std::string place;  // in errors
  CellType type;
  Words words;
};

class ArrowTable {
 public:
  ArrowTable(const ArrowSchema& schema, std::vector<Chunk> chunks, const std::string& name)
      : is_table_(schema.format != nullptr && std::strcmp(schema.format, "+s") == 0 && schema.dictionary == nullptr),
        chunks_(std::move(chunks)) {
    if (!is_table_) {
      add(schema, name);
    } else {
      if (schema.n_children < 0 || (schema.n_children > 0 && schema.children == nullptr)) {
        throw std::runtime_error("the Arrow schema has no columns where it says that it has");
      }
      for (std::int64_t j = 0; j < schema.n_children; ++j) {
        if (schema.children[j] == nullptr) throw std::runtime_error("the Arrow schema lacks a column");
        add(*schema.children[j], "");
      }
    }
    for (const Chunk& chunk : chunks_) {
      require(*chunk);
      if (chunk->length > std::numeric_limits<std::int64_t>::max() / 2 - rows_) {
        throw std::runtime_error("the Arrow stream has too many rows");
      }
      rows_ += chunk->length;
    }
  }

  // The values, rows x columns.
  Eigen::MatrixXd read() {
    const double bytes = static_cast<double>(rows_) * static_cast<double>(columns_.size()) * sizeof(double);
    const double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
    if (bytes > memory) throw std::bad_alloc();
    Eigen::MatrixXd values(rows_, std::ssize(columns_));
    Eigen::Index first = 0;
    const nb::gil_scoped_release unlocked;
    for (const Chunk& chunk : chunks_) {
      for (std::size_t j = 0; j < columns_.size(); ++j) {
        double* const out = values.col(static_cast<Eigen::Index>(j)).data() + first;
        ColumnOfTable& column = columns_[j];
        const ArrowArray& cells = is_table_ ? *chunk->children[j] : *chunk;
        read_cells(cells, column.type, is_table_ ? chunk->offset : 0, chunk->length, column.place, column.words, out);
        clear_absent_rows(*chunk, out);
      }
      first += chunk->length;
    }
    return values;
  }

  // A tuple for each column: its name, its kind, and its words or None.
  nb::list columns() const {
    nb::list result;
    for (const ColumnOfTable& column : columns_) {
      nb::object words = nb::none();
      if (column.type.is_text()) {
        nb::list texts;
        for (const std::string_view word : column.words.in_order) {
          const auto text = decoded(word);
          if (!text) throw std::runtime_error(fmt::format("{} has a text that is not UTF-8", column.place));
          texts.append(*text);
        }
        words = texts;
      }
      const char* const kind = column.type.kind == CellType::Kind::date ? "dates"
                               : column.type.is_text()                  ? "words"
                               : column.type.is_dictionary              ? "codes"
                                                                        : "numbers";
      result.append(nb::make_tuple(column.name, kind, words));
    }
    return result;
  }

  bool is_table() const { return is_table_; }

 private:
  void add(const ArrowSchema& schema, const std::string& place) {
    const char* const bytes = schema.name == nullptr ? "" : schema.name;
    const std::string shown = place.empty() ? fmt::format("column \"{}\"", legible(bytes)) : place;
    const auto name = decoded(bytes);
    if (!name) throw std::runtime_error(shown + " has a name that is not UTF-8");
    columns_.push_back({*name, shown, cell_type(schema, shown), {}});
  }

  void require(const ArrowArray& chunk) const {
    if (!is_table_) return require_cells(chunk, columns_.front().type, 0, chunk.length, columns_.front().place);
    constexpr std::int64_t most = std::int64_t{1} << 56;
    if (chunk.length < 0 || chunk.offset < 0 || chunk.length > most || chunk.offset > most) {
      throw std::runtime_error(
          fmt::format("the Arrow data are broken: length {}, offset {}", chunk.length, chunk.offset));
    }
    if (chunk.n_children != std::ssize(columns_) || (chunk.n_children > 0 && chunk.children == nullptr)) {
      throw std::runtime_error(fmt::format("the Arrow data are broken: {} columns where the schema has {}",
                                           chunk.n_children, columns_.size()));
    }
    if (chunk.n_buffers > 1 || (chunk.n_buffers == 1 && chunk.buffers == nullptr) || chunk.n_buffers < 0) {
      throw std::runtime_error(fmt::format("the Arrow data are broken: a table has {} buffers", chunk.n_buffers));
    }
    for (std::size_t j = 0; j < columns_.size(); ++j) {
      if (chunk.children[j] == nullptr)
        throw std::runtime_error(columns_[j].place + " has no data in the Arrow stream");
      require_cells(*chunk.children[j], columns_[j].type, chunk.offset, chunk.length, columns_[j].place);
    }
  }

  // Rows of a struct that are missing are so in all columns.
  void clear_absent_rows(const ArrowArray& chunk, double* out) const {
    const void* const present = is_table_ && chunk.n_buffers == 1 ? chunk.buffers[0] : nullptr;
    for (std::int64_t i = 0; present != nullptr && i < chunk.length; ++i) {
      if (!bit(present, chunk.offset + i)) out[i] = std::numeric_limits<double>::quiet_NaN();
    }
  }

  bool is_table_;
  std::vector<ColumnOfTable> columns_;
  std::vector<Chunk> chunks_;
  Eigen::Index rows_ = 0;
};

// A capsule with a stream, or two with a schema and an array. Returns the values as float64 (rows x columns; NaN:
// missing; a word is its position in the column's list of words), of each column (name, kind, words), and whether it is
// a table or a column by itself, which is called `name` in errors. Kinds: "numbers", "words", "dates", whose words are
// date_text(), and "codes": a dictionary of numbers.
nb::object read_arrow(const nb::object& capsule, const nb::object& array, const std::string& name) {
  Schema schema;
  std::vector<Chunk> chunks;
  RowStream stream;  // lives as long as its chunks
  if (array.is_none()) {
    stream = taken<ArrowArrayStream>(capsule, "arrow_array_stream");
    schema = schema_of(stream);
  } else {
    schema = taken<ArrowSchema>(capsule, "arrow_schema");
    chunks.push_back(taken<ArrowArray>(array, "arrow_array"));
  }
  if (schema.empty()) throw std::runtime_error("the Arrow stream has no schema");
  ArrowTable(*schema, {}, name);  // types that cannot be read are refused before the data are made
  if (array.is_none()) chunks = chunks_of(stream);
  ArrowTable table(*schema, std::move(chunks), name);
  Eigen::MatrixXd values = table.read();
  const nb::list columns = table.columns();
  return nb::make_tuple(array_of<double>(std::move(values)), columns, table.is_table());
}

// The texts of moments that are counted from 1970 on.
std::vector<std::string> date_texts(const std::vector<std::int64_t>& counts, std::int64_t per_day) {
  std::vector<std::string> texts;
  for (const std::int64_t count : counts) texts.push_back(date_text(count, per_day));
  return texts;
}

}  // namespace

void add_arrow(nb::module_& module) {
  module.def("date_texts", &date_texts, nb::arg("counts"), nb::arg("per_day"));
  module.def("read_arrow", &read_arrow, nb::arg("capsule"), nb::arg("array") = nb::none(), nb::kw_only(),
             nb::arg("name") = "the column");
}

}  // namespace llmt::python
