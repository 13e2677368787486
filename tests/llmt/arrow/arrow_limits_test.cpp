// Arrow files whose metadata say more than the file has: each limit just below and just above.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/arrow.hpp"
#include "llmt/files.hpp"
#include "oracles/arrow_edit.hpp"
#include "oracles/arrow_files.hpp"

namespace llmt {
namespace {

class ArrowLimits : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }

  // A file of these columns, each with `rows` ones.
  std::string file_of(const std::vector<std::string>& columns, Eigen::Index rows) const {
    bool is_given = false;
    write_arrow(path_, columns, [&]() -> std::optional<Eigen::MatrixXd> {
      if (std::exchange(is_given, true)) return std::nullopt;
      return Eigen::MatrixXd::Ones(rows, std::ssize(columns));
    });
    return read_file(path_);
  }

  ArrowTable open(const std::string& bytes) const {
    std::ofstream(path_, std::ios::binary) << bytes;
    return ArrowTable::open(path_);
  }

  // What opening these bytes ends in, without the file's name; empty: they are taken.
  std::string refusal(const std::string& bytes) const {
    try {
      open(bytes);
      return "";
    } catch (const std::runtime_error& error) {
      const std::string message = error.what();
      EXPECT_TRUE(message.starts_with(path_ + ": ")) << message;
      return message.substr(path_.size() + 2);
    }
  }

  std::string path_ =
      (std::filesystem::temp_directory_path() / ("llmt_limits_" + std::to_string(std::random_device()()) + ".arrow"))
          .string();
};

TEST_F(ArrowLimits, ABatchIsNamedOnce) {
  const std::string file = file_of({"x", "y"}, 3);
  EXPECT_EQ(refusal(arrow_edit::with_repeated_batch(file, 1)), "");
  EXPECT_EQ(open(arrow_edit::with_repeated_batch(file, 1)).rows(), 3);
  EXPECT_EQ(refusal(arrow_edit::with_repeated_batch(file, 2)), "batch 1 and batch 2 overlap");
  // The last byte of a batch is the first one of the next.
  std::string shifted = arrow_edit::with_repeated_batch(file, 2);
  const std::size_t entry = arrow_edit::batches(shifted) + 24;
  const auto begin = arrow_edit::number<std::int64_t>(shifted, entry);
  const std::int64_t bytes =
      arrow_edit::number<std::int32_t>(shifted, entry + 8) + arrow_edit::number<std::int64_t>(shifted, entry + 16);
  arrow_edit::set(shifted, entry, begin + bytes - 1);
  arrow_edit::set<std::int64_t>(shifted, entry + 16, 0);
  arrow_edit::set<std::int32_t>(shifted, entry + 8, 8);
  EXPECT_EQ(refusal(shifted), "batch 1 and batch 2 overlap");
  arrow_edit::set(shifted, entry, begin + bytes);
  EXPECT_EQ(refusal(shifted), "the metadata is damaged");  // what stands there is no batch
}

TEST_F(ArrowLimits, ADictionaryIsNamedOnceToo) {
  std::string file = arrow_files::words();
  EXPECT_EQ(refusal(file), "");
  // The entry of the first batch names the dictionary.
  file.replace(arrow_edit::batches(file), 24, file.substr(arrow_edit::dictionaries(file), 24));
  EXPECT_EQ(refusal(file), "dictionary 1 and batch 1 overlap");
}

TEST_F(ArrowLimits, AByteBelongsToOneColumn) {
  std::string file = file_of({"x", "y"}, 8);
  // Buffers of a batch: of each column where values are missing, and the values; 16 bytes an entry.
  const std::size_t of_y =
      arrow_edit::vector(file, arrow_edit::header(file, arrow_edit::batches(file)), 2) + std::size_t{3} * 16;
  EXPECT_EQ(arrow_edit::number<std::int64_t>(file, of_y), 64);
  EXPECT_EQ(refusal(file), "");
  arrow_edit::set<std::int64_t>(file, of_y, 63);
  EXPECT_EQ(refusal(file), "columns of batch 1 overlap");
  arrow_edit::set<std::int64_t>(file, of_y, 0);
  EXPECT_EQ(refusal(file), "columns of batch 1 overlap");
}

TEST_F(ArrowLimits, ARowTakesABit) {
  std::string file = file_of({"x"}, 8);
  const std::size_t entry = arrow_edit::batches(file);
  const std::size_t batch = arrow_edit::header(file, entry);
  arrow_edit::set<std::uint8_t>(file, arrow_edit::column_field(file, 0, 2), 6);  // a column of bits
  const auto with_rows = [&](std::int64_t rows) {
    arrow_edit::set(file, arrow_edit::field(file, batch, 0), rows);
    arrow_edit::set(file, arrow_edit::vector(file, batch, 1), rows);
    return file;
  };
  EXPECT_EQ(arrow_edit::number<std::int64_t>(file, entry + 16), 64);  // bytes of the body
  EXPECT_EQ(open(with_rows(64 * 8)).rows(), 64 * 8);
  EXPECT_EQ(refusal(with_rows(64 * 8 + 1)), "batch 1 has 513 rows in 64 bytes");
  EXPECT_EQ(refusal(with_rows(INT64_MAX)), "batch 1 has 9223372036854775807 rows in 64 bytes");
}

// That of the footer is a row of the tests Limits.
TEST_F(ArrowLimits, ABatchHasMetadataOfAQuarterOfAGibibyte) {
  const std::string file = file_of({"x"}, 1);
  const auto with_metadata = [&](std::int32_t length) {
    std::string bytes = file;
    arrow_edit::set(bytes, arrow_edit::batches(file) + 8, length);
    return bytes;
  };
  EXPECT_EQ(refusal(with_metadata(1 << 28)), "batch 1 lies outside of the file; it is cut off");
  EXPECT_EQ(refusal(with_metadata((1 << 28) + 1)),
            "batch 1 has 268435457 bytes of metadata; at most 268435456 are read");
}

// Names that lie in each other would be more text than the file has bytes.
TEST_F(ArrowLimits, NamesOfColumnsHaveBytesOfTheirOwn) {
  constexpr std::uint32_t length = 20000;
  constexpr std::uint32_t others = 9;
  std::string name(length, 'n');
  for (std::uint32_t k = 0; k < others; ++k) {  // each is the end of the one before
    const std::uint32_t rest = length - 4 * (k + 1);
    std::memcpy(name.data() + std::size_t{4} * k, &rest, sizeof rest);
  }
  std::vector<std::string> columns;
  for (std::uint32_t k = 0; k < others; ++k) columns.push_back(std::to_string(k));
  columns.push_back(name);  // references lead forwards
  std::string file = file_of(columns, 1);
  EXPECT_EQ(refusal(file), "");
  const std::size_t first = arrow_edit::follow(file, arrow_edit::column_field(file, others, 0));
  for (std::uint32_t k = 0; k < others; ++k) {
    const std::size_t place = arrow_edit::column_field(file, k, 0);
    arrow_edit::set(file, place, static_cast<std::uint32_t>(first + 4 * (k + 1) - place));
  }
  EXPECT_EQ(refusal(file), "the metadata is damaged: names of columns overlap");
}

// Room is taken for the rows that there are: 65 536 of them would be 10 GB here.
TEST_F(ArrowLimits, FewRowsOfManyColumnsTakeRoomForFewRows) {
  std::vector<std::string> columns;
  for (int k = 0; k < 20000; ++k) columns.push_back(std::to_string(k));
  Eigen::Index given = 0;
  const auto next = [&]() -> std::optional<Eigen::MatrixXd> {
    if (given == 900) return std::nullopt;
    Eigen::MatrixXd rows(300, 20000);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i).setConstant(static_cast<double>(given++));
    return rows;
  };
  EXPECT_EQ(write_arrow(path_, columns, next), 900);
  const ArrowTable table = ArrowTable::open(path_);
  ASSERT_EQ(table.rows(), 900);
  const Eigen::MatrixXd last = table.read(0, 900, std::vector<std::string>{"19999"});
  EXPECT_EQ(last.col(0), Eigen::VectorXd::LinSpaced(900, 0.0, 899.0));
  // A batch has at most 2^24 cells: 838 rows here.
  const std::string file = read_file(path_);
  EXPECT_EQ(arrow_edit::number<std::uint32_t>(file, arrow_edit::batches(file) - 4), 2);
  EXPECT_EQ(arrow_edit::number<std::int64_t>(
                file, arrow_edit::field(file, arrow_edit::header(file, arrow_edit::batches(file)), 0)),
            838);
}

}  // namespace
}  // namespace llmt
