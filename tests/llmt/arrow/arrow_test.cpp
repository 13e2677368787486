// Tables in Arrow files: what is written is read, and what is damaged is refused.
#include "llmt/arrow.hpp"

#include <fmt/format.h>
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
#include "oracles/arrow_files.hpp"

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

TEST_F(ArrowTest, TextIsReadWholeAndByItsDictionary) {
  const std::string whole = arrow_files::words();
  write_file(path_, whole);
  const ArrowTable table = ArrowTable::open(path_);
  using Words = std::vector<std::string>;
  EXPECT_EQ(table.texts(0, 4, "w"), (Words{"low", "", "high", "low"}));
  EXPECT_EQ(table.texts(0, 4, "l"), (Words{"a", "", "", "caf\xc3\xa9"}));
  EXPECT_EQ(table.texts(0, 4, "s"), (Words{"", "b", "", "ccc"}));
  EXPECT_EQ(table.texts(2, 2, "w"), (Words{"high", "low"}));
  EXPECT_EQ(table.texts(1, 2, "s"), (Words{"b", ""}));
  EXPECT_TRUE(table.texts(4, 0, "l").empty());
  EXPECT_TRUE(table.has_text("w") && table.has_text("l") && table.has_text("s"));
  EXPECT_THROW(table.read(0, 1, Words{"w"}), std::runtime_error);
  EXPECT_THROW(table.texts(3, 2, "w"), std::invalid_argument);
  // No changed byte ends in anything but words or an error.
  Eigen::Index refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 2) {
    for (const int change : {1, 128}) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ change);
      std::ofstream(path_, std::ios::binary) << bytes;
      try {
        const ArrowTable changed = ArrowTable::open(path_);
        if (changed.rows() > 1000) continue;
        for (const std::string& column : changed.columns()) {
          if (changed.has_text(column)) changed.texts(0, changed.rows(), column);
        }
      } catch (const std::runtime_error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with(path_)) << error.what();
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 50);
}

TEST_F(ArrowTest, DatesAreReadAsTheirText) {
  write_file(path_, arrow_files::dates());
  const ArrowTable table = ArrowTable::open(path_);
  using Words = std::vector<std::string>;
  EXPECT_EQ(table.texts(0, 4, "d"), (Words{"2024-02-29", "", "1969-12-31", "0001-01-01"}));
  EXPECT_EQ(table.texts(0, 4, "m"), (Words{"2024-02-29 12:34:56.789", "", "1969-12-31 23:59:59.999", "1970-01-01"}));
  EXPECT_EQ(table.texts(0, 4, "n"), (Words{"2024-02-29 00:00:00.123456789", "1970-01-01", "", "1969-12-31"}));
  EXPECT_EQ(table.texts(2, 2, "d"), (Words{"1969-12-31", "0001-01-01"}));
  EXPECT_TRUE(table.has_text("d") && table.has_text("m") && table.has_text("n"));
  EXPECT_FALSE(table.has_text("y"));
  EXPECT_THROW(table.read(0, 1, Words{"d"}), std::runtime_error);
}

// The Gregorian calendar, counted year by year.
TEST(DateText, IsThatOfTheGregorianCalendar) {
  std::int64_t new_year = 0;  // days since 1970 on the first of January
  for (int year = 1970; year < 9999; ++year) {
    const bool is_leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
    const std::string of_year = fmt::format("{:04}", year);
    ASSERT_EQ(date_text(new_year, 1), of_year + "-01-01");
    ASSERT_EQ(date_text(new_year + 58, 1), of_year + "-02-28");
    ASSERT_EQ(date_text(new_year + 59, 1), of_year + (is_leap ? "-02-29" : "-03-01"));
    ASSERT_EQ(date_text((new_year + 181) * 86'400'000 + 3'723'040, 86'400'000),
              of_year + (is_leap ? "-06-30" : "-07-01") + " 01:02:03.04");
    new_year += is_leap ? 366 : 365;
    ASSERT_EQ(date_text(new_year - 1, 1), of_year + "-12-31");
  }
  EXPECT_EQ(date_text(-719'468, 1), "0000-03-01");
  EXPECT_EQ(date_text(-719'469, 1), "0000-02-29");
  EXPECT_EQ(date_text(std::numeric_limits<std::int32_t>::max(), 1), "day 2147483647 of 1970");
  EXPECT_EQ(date_text(-1, 86'400), "1969-12-31 23:59:59");
  EXPECT_EQ(date_text(std::numeric_limits<std::int64_t>::max(), 86'400'000'000'000), "2262-04-11 23:47:16.854775807");
}

TEST_F(ArrowTest, AFileOfAnotherProgramIsRead) {
  write_file(path_, arrow_files::numbers());
  const ArrowTable table = ArrowTable::open(path_);
  EXPECT_EQ(table.columns(), (std::vector<std::string>{"a", "s", "b", "c", "d"}));
  const double none = std::numeric_limits<double>::quiet_NaN();
  Eigen::MatrixXd expected(3, 4);
  expected << -128.0, 1.0, 1.5, 1099511627776.0, 0.0, none, -2.25, -1.0, 127.0, 65535.0, none, none;
  EXPECT_TRUE(same_cells(table.read(0, 3, std::vector<std::string>{"a", "b", "c", "d"}), expected));
  EXPECT_TRUE(same_cells(table.read(1, 2, std::vector<std::string>{"d"}), expected.bottomRightCorner(2, 1)));
  EXPECT_THROW(table.read(0, 1, std::vector<std::string>{"s"}), std::runtime_error);
  EXPECT_EQ(table.texts(0, 3, "s"), (std::vector<std::string>{"x", "", "yy"}));
  EXPECT_THROW(table.texts(0, 1, "a"), std::runtime_error);
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
