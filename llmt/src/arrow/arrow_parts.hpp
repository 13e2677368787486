/// \file
/// What is known of an open Arrow file. Parts are read when they are asked for, by number of byte: a file that somebody
/// cuts off meanwhile is an error, where mapped memory would end the program.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "arrow/flatbuffer.hpp"
#include "arrow/table_bytes.hpp"
#include "llmt/arrow.hpp"

namespace llmt {

namespace arrow_file {

/// What the values of a column are, or the indices into its dictionary.
enum class Numbers { none, int8, int16, int32, int64, uint8, uint16, uint32, uint64, float32, float64 };

/// What text the values of a column or of its dictionary are, by the size of the offsets.
enum class Text { none, small, large };

struct Column {
  std::string name;
  Numbers numbers = Numbers::none;
  Text text = Text::none;
  std::optional<std::int64_t> dictionary;  ///< its number; `text` are its values
  std::size_t buffers = 2;
  std::size_t first_buffer = 0;  ///< among those of a batch
  std::int64_t per_day = 0;      ///< of dates: how many units a day has, of which `numbers` count

  bool is_date() const { return per_day > 0; }
  bool is_number() const { return numbers != Numbers::none && !dictionary && !is_date(); }
};

struct Batch {
  Eigen::Index first = 0;  ///< row
  Eigen::Index rows = 0;
  std::int64_t body = 0;                             ///< where it begins in the file
  std::vector<std::int64_t> missing;                 ///< of every column
  std::vector<std::array<std::int64_t, 2>> buffers;  ///< offset in the body, and length
};

/// The words of a column of text that has each of them once.
struct Dictionary {
  std::vector<std::string> words;
  std::size_t longest = 0;  ///< bytes of a word
};

/// A message of the file: where its metadata begin, how long they are, and how long the body behind them is.
struct Block {
  std::int64_t begin = 0;
  std::int64_t metadata = 0;
  std::int64_t body = 0;
  std::string name;  ///< "batch 3": for errors
};

inline std::size_t bytes_of(Numbers numbers) {
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

}  // namespace arrow_file

struct ArrowTable::Parts {
  explicit Parts(TableBytes of) : bytes(std::move(of)), size(bytes.size()) {}

  TableBytes bytes;
  std::int64_t size;
  std::vector<arrow_file::Column> columns;
  std::vector<std::string> names;
  std::unordered_map<std::string, std::size_t> places;               ///< of the names
  std::unordered_map<std::int64_t, std::size_t> dictionary_columns;  ///< the first column of each dictionary
  std::vector<arrow_file::Batch> batches;
  std::map<std::int64_t, arrow_file::Dictionary> dictionaries;  ///< of text
  Eigen::Index rows = 0;

  [[noreturn]] void fail(const std::string& why) const { bytes.fail(why); }

  std::string read(std::int64_t at, std::int64_t count) const { return bytes.read(at, count); }

  const arrow_file::Column& column(const std::string& name) const;

  /// Rows begin ... end - 1 of a batch; NaN where a value is missing.
  void read_numbers(const arrow_file::Batch& batch, const arrow_file::Column& column, Eigen::Index begin,
                    Eigen::Index end, Eigen::Ref<Eigen::VectorXd> to) const;

  /// The texts of rows begin ... end - 1 of a column of dates; empty where one is missing.
  std::vector<std::string> read_dates(const arrow_file::Batch& batch, const arrow_file::Column& column,
                                      Eigen::Index begin, Eigen::Index end) const;

  std::vector<bool> read_valid(const arrow_file::Batch& batch, const arrow_file::Column& column, Eigen::Index begin,
                               Eigen::Index end) const;

  /// The texts of rows begin ... end - 1 whose first buffer is `buffer`. `column`: for errors.
  std::vector<std::string> read_texts(const arrow_file::Batch& batch, std::size_t buffer, arrow_file::Text text,
                                      Eigen::Index begin, Eigen::Index end, const std::string& column) const;

  /// `most_bytes`: of all names together, which are those of the footer.
  void read_schema(const FlatTable& schema, std::size_t most_bytes);
  void read_dictionary(const arrow_file::Block& block);
  void read_batch(const arrow_file::Block& block);
  void read_all();
};

}  // namespace llmt
