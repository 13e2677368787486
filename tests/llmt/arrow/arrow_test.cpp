// Tables in Arrow files: what is written is read, and what is damaged is refused.
#include "llmt/arrow.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/files.hpp"

namespace llmt {
namespace {

class ArrowTest : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }

  void write(const std::vector<std::string>& columns, const Eigen::MatrixXd& values, Eigen::Index rows_at_once) const {
    Eigen::Index next = 0;
    const Eigen::Index written = write_arrow(path_, columns, [&]() -> std::optional<Eigen::MatrixXd> {
      if (next >= values.rows()) return std::nullopt;
      const Eigen::Index count = std::min(rows_at_once, values.rows() - next);
      next += count;
      return values.middleRows(next - count, count);
    });
    EXPECT_EQ(written, values.rows());
  }

  std::string path_ =
      (std::filesystem::temp_directory_path() / ("llmt_arrow_" + std::to_string(std::random_device()()) + ".arrow"))
          .string();
};

bool same_cells(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return false;
  for (Eigen::Index k = 0; k < a.size(); ++k) {
    const double x = a.data()[k];
    const double y = b.data()[k];
    if (std::isnan(x) != std::isnan(y)) return false;
    if (!std::isnan(x) && std::memcmp(&x, &y, sizeof x) != 0) return false;
  }
  return true;
}

TEST_F(ArrowTest, EveryRangeOfRowsIsReadAsItWasWritten) {
  Eigen::MatrixXd values = Eigen::MatrixXd::Random(140000, 2);  // three batches
  values(3, 0) = -0.0;
  values(7, 1) = values(65535, 1) = values(65536, 1) = std::numeric_limits<double>::quiet_NaN();
  write({"x", "caf\xc3\xa9"}, values, 1000);
  EXPECT_TRUE(is_arrow_file(path_));
  const ArrowTable table = ArrowTable::open(path_);
  EXPECT_EQ(table.rows(), values.rows());
  EXPECT_EQ(table.columns(), (std::vector<std::string>{"x", "caf\xc3\xa9"}));
  EXPECT_TRUE(same_cells(table.read(0, values.rows(), table.columns()), values));
  for (const auto& [first, count] : {std::pair<Eigen::Index, Eigen::Index>{0, 0},
                                     {5, 9},
                                     {65530, 12},
                                     {65536, 65536},
                                     {131000, 9000},
                                     {139999, 1},
                                     {140000, 0}}) {
    const std::vector<std::string> reversed = {"caf\xc3\xa9", "x"};
    const Eigen::MatrixXd expected = values.middleRows(first, count).rowwise().reverse();
    EXPECT_TRUE(same_cells(table.read(first, count, reversed), expected)) << first;
  }
  EXPECT_THROW(table.read(139999, 2, table.columns()), std::invalid_argument);
  EXPECT_THROW(table.read(0, 1, std::vector<std::string>{"y"}), std::runtime_error);
}

TEST_F(ArrowTest, ATableWithoutRowsHasColumns) {
  write({"x"}, Eigen::MatrixXd(0, 1), 10);
  EXPECT_EQ(ArrowTable::open(path_).rows(), 0);
  EXPECT_EQ(ArrowTable::open(path_).columns(), std::vector<std::string>{"x"});
}

// Columns a: int8, s: text, b: uint16, c: float, d: int64, in batches of two rows and one. By pyarrow 26:
// pa.ipc.new_file(sink, table.schema).write_table(table, max_chunksize=2).
const char* const written_by_pyarrow =
    "4152524f57310000ffffffff380100001000000000000a000c000600050008000a000000000104000c000000080008000000"
    "0400080000000400000005000000d00000009400000064000000340000000400000054ffffff000001021000000014000000"
    "0400000000000000010000006400000044ffffff000000014000000080ffffff000001031000000018000000040000000000"
    "00000100000063000600080006000600000000000100acffffff000001021000000018000000040000000000000001000000"
    "62000600080004000600000010000000d8ffffff000001051000000018000000040000000000000001000000730000000400"
    "040004000000100014000800060007000c00000010001000000000000102100000001c000000040000000000000001000000"
    "6100000008000c000800070008000000000000010800000000000000ffffffff5801000014000000000000000c0016000600"
    "050008000c000c0000000003040018000000600000000000000000000a0018000c00040008000a000000cc00000010000000"
    "0200000000000000000000000b00000000000000000000000000000000000000000000000000000003000000000000000800"
    "000000000000010000000000000010000000000000000c000000000000002000000000000000030000000000000028000000"
    "0000000001000000000000003000000000000000060000000000000038000000000000000000000000000000380000000000"
    "00000c0000000000000048000000000000000000000000000000480000000000000018000000000000000000000005000000"
    "0200000000000000000000000000000002000000000000000100000000000000020000000000000001000000000000000200"
    "00000000000000000000000000000200000000000000000000000000000080007f0000000000050000000000000000000000"
    "0100000001000000000000007879790000000000050000000000000001000000ffff00000000c03f000010c0000000000000"
    "00000000000000010000ffffffffffffffff0000000000000000ffffffff5801000014000000000000000c00160006000500"
    "08000c000c0000000003040018000000400000000000000000000a0018000c00040008000a000000cc000000100000000100"
    "000000000000000000000b000000000000000000000000000000000000000000000000000000010000000000000008000000"
    "0000000000000000000000000800000000000000080000000000000010000000000000000200000000000000180000000000"
    "0000000000000000000018000000000000000200000000000000200000000000000001000000000000002800000000000000"
    "0400000000000000300000000000000001000000000000003800000000000000080000000000000000000000050000000100"
    "0000000000000000000000000000010000000000000000000000000000000100000000000000000000000000000001000000"
    "000000000100000000000000010000000000000001000000000000007f000000000000000000000002000000797900000000"
    "0000ffff0000000000000000000000000000000000000000000000000000000000000000000000000000ffffffff00000000"
    "100000000c001400060008000c0010000c000000000004005000000040000000040000000200000048010000000000006001"
    "0000000000006000000000000000080300000000000060010000000000004000000000000000000000000000000008000800"
    "00000400080000000400000005000000d00000009400000064000000340000000400000054ffffff00000102100000001400"
    "00000400000000000000010000006400000044ffffff000000014000000080ffffff00000103100000001800000004000000"
    "000000000100000063000600080006000600000000000100acffffff00000102100000001800000004000000000000000100"
    "000062000600080004000600000010000000d8ffffff00000105100000001800000004000000000000000100000073000000"
    "0400040004000000100014000800060007000c00000010001000000000000102100000001c00000004000000000000000100"
    "00006100000008000c0008000700080000000000000108000000780100004152524f5731";

TEST_F(ArrowTest, AFileOfAnotherProgramIsRead) {
  const std::string_view text = written_by_pyarrow;
  std::string bytes;
  for (std::size_t at = 0; at < text.size(); at += 2) {
    bytes += static_cast<char>(std::stoi(std::string(text.substr(at, 2)), nullptr, 16));
  }
  write_file(path_, bytes);
  const ArrowTable table = ArrowTable::open(path_);
  EXPECT_EQ(table.columns(), (std::vector<std::string>{"a", "s", "b", "c", "d"}));
  const double none = std::numeric_limits<double>::quiet_NaN();
  Eigen::MatrixXd expected(3, 4);
  expected << -128.0, 1.0, 1.5, 1099511627776.0, 0.0, none, -2.25, -1.0, 127.0, 65535.0, none, none;
  EXPECT_TRUE(same_cells(table.read(0, 3, std::vector<std::string>{"a", "b", "c", "d"}), expected));
  EXPECT_TRUE(same_cells(table.read(1, 2, std::vector<std::string>{"d"}), expected.bottomRightCorner(2, 1)));
  EXPECT_THROW(table.read(0, 1, std::vector<std::string>{"s"}), std::runtime_error);
}

// No changed byte of the file may end in anything but numbers or an error.
TEST_F(ArrowTest, DamagedFilesAreRefusedOrRead) {
  write({"x", "y"}, Eigen::MatrixXd::Random(9, 2), 9);
  const std::string whole = read_file(path_);
  Eigen::Index refused = 0;
  const auto try_to_read = [&](const std::string& bytes) {
    std::ofstream(path_, std::ios::binary) << bytes;  // write_file() would wait for the disk
    try {
      const ArrowTable table = ArrowTable::open(path_);
      if (table.rows() < 1000) table.read(0, table.rows(), table.columns());
    } catch (const std::runtime_error& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with(path_)) << error.what();
      ++refused;
    }
  };
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    refused = 0;
    try_to_read(whole.substr(0, length));
    EXPECT_EQ(refused, 1) << length;
  }
  refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 3) {
    for (const int change : {1, 128}) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ change);
      try_to_read(bytes);
    }
  }
  EXPECT_GT(refused, 50);
  write_file(path_, "x,y\n1,2\n");
  EXPECT_FALSE(is_arrow_file(path_));
  EXPECT_THROW(ArrowTable::open(path_), std::runtime_error);
  EXPECT_THROW(ArrowTable::open(path_ + "_none"), std::runtime_error);
}

}  // namespace
}  // namespace llmt
