#include <fmt/format.h>
#include <gtest/gtest.h>

#include <sstream>
#include <stdexcept>

#include "llmt/csv.hpp"

namespace {

// Cells of all pieces, or the error.
std::string all_cells(const std::string& text, std::size_t bytes) {
  std::istringstream stream(text);
  llmt::CsvPieces pieces(stream, "t.csv", bytes);
  std::string result;
  try {
    while (const std::optional<llmt::Csv> piece = pieces.next()) {
      EXPECT_GT(piece->rows(), 0);
      const Eigen::MatrixXd values = piece->numbers_or_missing(std::vector<std::string>{"a"});
      const std::vector<std::string> words = piece->texts("b");
      for (Eigen::Index i = 0; i < values.rows(); ++i) {
        result += fmt::format("{}:{}|{}\n", piece->line_of(i), values(i, 0), words[i]);
      }
    }
  } catch (const std::runtime_error& error) {
    result += error.what();
  }
  return result;
}

// The same from a Csv that holds everything.
std::string whole(const std::string& text) {
  std::string result;
  try {
    const llmt::Csv csv = llmt::Csv::parse(text, "t.csv");
    const Eigen::MatrixXd values = csv.numbers_or_missing(std::vector<std::string>{"a"});
    const std::vector<std::string> words = csv.texts("b");
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      result += fmt::format("{}:{}|{}\n", csv.line_of(i), values(i, 0), words[i]);
    }
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return result;
}

TEST(CsvPieces, TogetherAreTheWholeTable) {
  const std::string text =
      "\xEF\xBB\xBF\"a\",b\r\n1,x\r\n\r\n2,\"y\nover, lines\"\r\nNA,z\r\n  \r\n4.5,\"a \"\"quote\"\"\"\r\n-6e3,last";
  ASSERT_NE(whole(text).find("6:nan"), std::string::npos) << whole(text);
  for (std::size_t bytes = 1; bytes < 100; ++bytes) {
    EXPECT_EQ(all_cells(text, bytes), whole(text)) << bytes;
    EXPECT_EQ(all_cells(text + "\n", bytes), whole(text)) << bytes;
    EXPECT_EQ(all_cells("\n \r\n" + text.substr(3), bytes), whole("\n \r\n" + text.substr(3))) << bytes;
  }
}

TEST(CsvPieces, AgreeOnBlankLinesAroundAByteOrderMark) {
  const std::string mark = "\xEF\xBB\xBF";
  for (const std::string& before :
       {"\n" + mark, mark + "\n", "\n \r\n" + mark + "\n", mark + mark, "\n" + mark + " \n\n"}) {
    const std::string text = before + "a,b\n1,x\n2,y\n";
    ASSERT_NE(whole(text).find(":1|x"), std::string::npos) << whole(text);
    for (std::size_t bytes = 1; bytes < 40; ++bytes) EXPECT_EQ(all_cells(text, bytes), whole(text)) << bytes;
  }
}

TEST(CsvPieces, ErrorsHaveTheLinesOfTheWholeText) {
  // Pieces before the error have been handed out.
  const std::string rows = "a;b\n1;x\n2;\"y\ny\"\n\n3;z\n";
  for (std::size_t bytes = 1; bytes < 40; ++bytes) {
    EXPECT_TRUE(all_cells(rows + "4\n5;v\n", bytes).ends_with("t.csv:7: the row has 1 field, the header has 2"))
        << bytes;
    EXPECT_TRUE(
        all_cells(rows + "4", bytes).ends_with("t.csv:7: the row has 1 field, the header has 2 (is the file cut off?)"))
        << bytes << all_cells(rows + "4", bytes);
    EXPECT_TRUE(all_cells(rows + "four;v\n", bytes).ends_with("t.csv:7: column \"a\": 'four' is not a number"))
        << bytes;
  }
  EXPECT_EQ(all_cells("", 10), whole(""));
  EXPECT_EQ(all_cells("a,a\n", 10), whole("a,a\n"));
  EXPECT_EQ(all_cells("a,b\n", 10), "");
}

// Advice about comments above the header is for the first row of the text, not of a piece. Found by the fuzz target
// csv.
TEST(CsvPieces, AdviseOnCommentsAsTheWholeTextDoes) {
  for (const std::string text : {"#,a,b\n0,1,x\n2,3\n4,5,z\n", "#,a,b\n2,3\n", "#,a,b\n\n0,1,x\n\n2,3\n1,2,x\n"}) {
    for (std::size_t bytes = 1; bytes < 20; ++bytes) {
      EXPECT_TRUE(all_cells(text, bytes).ends_with(whole(text))) << bytes << all_cells(text, bytes) << whole(text);
    }
  }
  EXPECT_TRUE(whole("#,a,b\n2,3\n").ends_with("delete comments above it"));
  EXPECT_TRUE(whole("#,a,b\n0,1,x\n2,3\n1,2,x\n").ends_with("the header has 3"));
}

TEST(CsvPieces, RefuseALineThatNamesTheSeparatorAsTheWholeTextDoes) {
  EXPECT_TRUE(whole("sep=;\r\r\n1;2\n").ends_with("delete it"));
}

TEST(CsvPieces, LastPieceOfBlanksIsNoHeaderAlone) {
  const std::string text = "a\rb;c\n1;2\n\r";
  for (std::size_t bytes = 1; bytes < 20; ++bytes) EXPECT_EQ(all_cells(text, bytes), whole(text)) << bytes;
}

}  // namespace
