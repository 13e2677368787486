#include "llmt/csv.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>

namespace {

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

std::string error_in(const std::string& text) {
  return error_of([&] {
    const llmt::Csv csv = llmt::Csv::parse(text, "t.csv");
    csv.numbers(csv.columns());
  });
}

TEST(Csv, ReadsNumbersInFileOrder) {
  const llmt::Csv csv = llmt::Csv::parse(
      "\xEF\xBB\xBF"
      "a, b ,c\r\n1,2.5,-3e-2\r\n\r\n+4, 5 ,\"6\"\r\n",
      "t.csv");
  EXPECT_EQ(csv.columns(), (std::vector<std::string>{"a", "b", "c"}));
  Eigen::MatrixXd expected(2, 2);
  expected << -3e-2, 1.0, 6.0, 4.0;
  EXPECT_EQ(csv.numbers(std::vector<std::string>{"c", "a"}), expected);
  EXPECT_EQ(csv.row_text(1), "+4, 5 ,\"6\"");
  EXPECT_EQ(csv.line_of(1), 4);
}

TEST(Csv, SeparatorsOfThousandsAreReadOnRequestAlone) {
  using llmt::Csv;
  using llmt::DecimalMark;
  const std::string text = "a;b\n\"1,234\";-12,345,678.5\n7;0.5\n";
  const Csv strict = Csv::parse(text, "t.csv");
  const llmt::CsvNumbers cells = strict.read_numbers(strict.columns());
  EXPECT_EQ(cells.cells[0].other_mark, 1);  // 1.234 with a decimal comma
  EXPECT_EQ(cells.cells[0].thousands, 0);
  EXPECT_EQ(cells.cells[1].thousands, 1);
  EXPECT_EQ(error_in(text),
            "t.csv:2: column \"a\": '1,234' has a comma, which may be a separator of thousands or a decimal comma");
  EXPECT_EQ(error_in("a;b\n1;1,234.5\n"), "t.csv:2: column \"b\": '1,234.5' has separators of thousands");
  for (const char* decimal : {"0,123", "1,5", "12,34", "1234,567", ",123", "1,234e3"}) {
    EXPECT_NE(error_in("a;b\n1;" + std::string(decimal) + "\n").find("has a decimal comma, and"), std::string::npos)
        << decimal;
  }
  for (const char* word : {"1,23,456", "1,234,56", "1,234.5.6"}) {
    EXPECT_NE(error_in("a;b\n1;" + std::string(word) + "\n").find("is not a number"), std::string::npos) << word;
  }
  Csv read = Csv::parse(text, "t.csv");
  read.read_thousands();
  Eigen::MatrixXd expected(2, 2);
  expected << 1234.0, -12345678.5, 7.0, 0.5;
  EXPECT_EQ(read.numbers(read.columns()), expected);
  Csv comma = Csv::parse("a;b\n1.234,5;2\n", "t.csv", DecimalMark::comma);
  comma.read_thousands();
  EXPECT_EQ(comma.numbers("a")(0), 1234.5);
}

TEST(Csv, AFirstLineThatIsNoHeaderIsSaid) {
  EXPECT_EQ(error_in("sep=;\na;b\n1;2\n").find("t.csv:1: a line that names the separator"), 0U);
  EXPECT_EQ(
      error_in("# hello\na,b\n1,2\n"),
      "t.csv:2: the row has 2 fields, the header has 1; the first line must be the header, delete comments above it");
  EXPECT_EQ(error_in("#a,b\n1,2\n"), "no error");
  EXPECT_EQ(error_in("a,b\r1,2\r3,4\r").find("t.csv:1: lines end with CR alone"), 0U);
  EXPECT_EQ(error_in("a,b\r\r\n1,2\r\r\n"), "no error");
  EXPECT_EQ(error_in("a,b\f1,2\f3,4").find("t.csv:1: lines end with a form feed"), 0U);
  EXPECT_EQ(error_in("a,b\xE2\x80\xA8"
                     "1,2")
                .find("t.csv:1: lines end with a form feed or a separator of Unicode"),
            0U);
  EXPECT_EQ(error_in("\"a,b\n1,2\n3,4\n").find("t.csv:1: a quote is left open"), 0U);
  EXPECT_EQ(llmt::Csv::parse("\"a\r\nb\",c\n1,2\n", "t.csv").columns().front(), "a\r\nb");
}

TEST(Csv, NumbersAreCorrectlyRounded) {
  const llmt::Csv csv = llmt::Csv::parse("a\n0.1\n1.7976931348623157e308\n5e-324\n9007199254740993\n", "t.csv");
  EXPECT_EQ(csv.numbers("a"), Eigen::Vector4d(0.1, 1.7976931348623157e308, 5e-324, 9007199254740992.0));
}

TEST(Csv, TakesSemicolonsAndTabsWhenTheHeaderHasNoComma) {
  EXPECT_EQ(llmt::Csv::parse("a;b\n1;2\n", "t").numbers("b")(0), 2.0);
  EXPECT_EQ(llmt::Csv::parse("a\tb\n1\t2", "t").numbers("b")(0), 2.0);
}

TEST(Csv, QuotedFieldsMayHoldAnything) {
  const llmt::Csv csv = llmt::Csv::parse("\"a, \"\"quoted\"\"\",b\n\"two\nlines\",1\nword,2\n", "t.csv");
  EXPECT_EQ(csv.columns()[0], "a, \"quoted\"");
  EXPECT_EQ(csv.numbers("b"), Eigen::Vector2d(1.0, 2.0));
  EXPECT_EQ(csv.line_of(1), 4);
  EXPECT_EQ(llmt::csv_field("a, \"quoted\""), "\"a, \"\"quoted\"\"\"");
}

TEST(Csv, WordsHurtOnlyWhoAsksForThem) {
  const llmt::Csv csv = llmt::Csv::parse("name,v\nleft,1\n", "t.csv");
  EXPECT_EQ(csv.numbers("v")(0), 1.0);
  EXPECT_EQ(error_of([&] { csv.numbers("name"); }), "t.csv:2: column \"name\": 'left' is not a number");
}

TEST(Csv, ErrorsNameFileLineAndColumn) {
  EXPECT_EQ(error_in(""), "t.csv: the file is empty, a header row is needed");
  EXPECT_EQ(error_in("a,b\n1,2\n3\n"), "t.csv:3: the row has 1 field, the header has 2 (is the file cut off?)");
  EXPECT_EQ(error_in("a,b\n1,2,3\n3,4\n"), "t.csv:2: the row has 3 fields, the header has 2");
  EXPECT_EQ(error_in("a,b\n1,\n"), "t.csv:2: column \"b\": the cell is empty, a number is needed");
  EXPECT_EQ(error_in("a,b\n1,nan\n"), "t.csv:2: column \"b\": 'nan' is not finite");
  EXPECT_EQ(error_in("a,b\n1,2\n\n1,inf\n"), "t.csv:4: column \"b\": 'inf' is not finite");
  EXPECT_EQ(error_in("a,b\n1,1e999\n"), "t.csv:2: column \"b\": '1e999' is not finite");
  EXPECT_EQ(error_in("a,b\n1,2 mm\n"), "t.csv:2: column \"b\": '2 mm' is not a number");
  EXPECT_EQ(error_in("a,b\n1,+-2\n"), "t.csv:2: column \"b\": '+-2' is not a number");
  EXPECT_EQ(error_in("a,b\n1,\n3,4\n"), "t.csv:2: column \"b\": the cell is empty, a number is needed");
  EXPECT_EQ(error_in("a,b\n1," + std::string(59, 'x') + "\u00E9 and more\n"),
            "t.csv:2: column \"b\": '" + std::string(59, 'x') + "...' is not a number");
  EXPECT_EQ(error_in("a,a\n1,2\n"), "t.csv:1: the header has column \"a\" twice");
  EXPECT_EQ(error_in(",a\n1,2\n"), "t.csv:1: column 1 of the header has no name");
  EXPECT_EQ(error_of([] { llmt::Csv::parse("a,b\n", "t.csv").numbers("c"); }),
            "t.csv: there is no column \"c\"; the columns are a, b");
  EXPECT_EQ(error_of([] { llmt::Csv::read("no/such/file.csv"); }),
            "no/such/file.csv: cannot be read: No such file or directory");
}

TEST(Csv, AColumnMayBeAskedForTwice) {
  const llmt::Csv csv = llmt::Csv::parse("a,b\n1,2\n3,4\n", "t.csv");
  Eigen::MatrixXd expected(2, 3);
  expected << 1.0, 2.0, 1.0, 3.0, 4.0, 3.0;
  EXPECT_EQ(csv.numbers(std::vector<std::string>{"a", "b", "a"}), expected);
}

TEST(Csv, CellsThatAreNoNumbersAreCounted) {
  const llmt::Csv csv = llmt::Csv::parse("a,b,c\n1,left,NA\n,right,\n3,?,inf\n", "t.csv");
  const llmt::CsvNumbers read = csv.read_numbers(csv.columns());
  EXPECT_EQ(read.cells[0].missing, 1);
  EXPECT_EQ(read.cells[0].first_missing, 1);
  EXPECT_EQ(read.cells[0].other, 0);
  EXPECT_EQ(read.cells[0].first_other, llmt::ColumnCells::no_row);
  EXPECT_EQ(read.cells[1].other, 2);
  EXPECT_EQ(read.cells[1].first_other, 0);
  EXPECT_EQ(read.cells[2].first_missing, 0);
  EXPECT_EQ(read.cells[2].first_other, 2);
  EXPECT_EQ(read.cells[1].infinite, 0);
  EXPECT_EQ(read.cells[2].infinite, 1);
  EXPECT_EQ(read.values.array().isNaN().count(), 7);
  const std::vector<Eigen::Index> rows = {llmt::ColumnCells::no_row, 1, 1};
  EXPECT_EQ(error_of([&] { csv.refuse_first(csv.columns(), rows); }), "t.csv:3: column \"b\": 'right' is not a number");
}

TEST(Csv, AHeaderAloneHasNoRows) { EXPECT_EQ(llmt::Csv::parse("a,b\n", "t.csv").rows(), 0); }

TEST(Csv, TextThatIsNotUtf8IsNamed) {
  const auto header = [](const std::string& text) { return error_in(text); };
  const std::string utf_16 = "t.csv: this is UTF-16 or no text at all, UTF-8 is needed";
  EXPECT_EQ(header(std::string("\xFF\xFE"
                               "a\0,\0b\0\n\0",
                               10)),
            utf_16);
  EXPECT_EQ(header(std::string("\xFE\xFF"
                               "\0a\0,\0b\0\n",
                               10)),
            utf_16);
  EXPECT_EQ(header(std::string("a\0,\0b\0\n\0", 8)), utf_16);
  EXPECT_EQ(header(std::string("ARROW1\0\0\xFF\xFF\xFF\xFF", 12)),
            "t.csv: this is an Arrow file, a table of text is needed; llmt fit and llmt predict read both");
  // Cut off, longer than needed, half of a pair of UTF-16, beyond U+10FFFF, a byte that begins nothing.
  const std::map<std::string, std::string> first_bytes = {
      {"b\xC3", "c3"},        {"b\xE2\x82", "e2"},        {"\xC0\xAF", "c0"}, {"\xE0\x80\xAF", "e0"},
      {"\xED\xA0\x80", "ed"}, {"\xF4\x90\x80\x80", "f4"}, {"\xFF", "ff"},     {"\xC3\xB6\xF6", "f6"}};
  for (const auto& [name, byte] : first_bytes) {
    EXPECT_EQ(header("\n\na," + name + "\n"),
              "t.csv:3: byte 0x" + byte + " of the name of column 2 of the header is not UTF-8");
  }
  EXPECT_EQ(llmt::Csv::parse("\xC3\xB6,\xE2\x82\xAC,\xF0\x9F\x8C\xB2,\xEE\x80\x80\n", "t").columns().size(), 4U);
  const llmt::Csv csv = llmt::Csv::parse("a,b\n1,\xF6\n2,x\n", "t.csv");
  EXPECT_EQ(csv.numbers("a")(1), 2.0);
  EXPECT_EQ(error_of([&] { csv.texts("b"); }), "t.csv:2: column \"b\": byte 0xf6 of the cell is not UTF-8");
}

TEST(Csv, TheOtherDecimalMarkHasAnErrorOfItsOwn) {
  for (const auto& [mark, cell] :
       std::map<llmt::DecimalMark, std::string>{{llmt::DecimalMark::comma, "1.5"}, {llmt::DecimalMark::point, "1,5"}}) {
    const llmt::Csv csv = llmt::Csv::parse("a;b\n" + cell + ";2\n", "t.csv", mark);
    try {
      csv.numbers("a");
      ADD_FAILURE() << cell;
    } catch (const llmt::DecimalMarkError& error) {
      EXPECT_NE(error.found(), mark);
    }
  }
}

TEST(Csv, AByteOfZeroDoesNotEndAMessage) {
  EXPECT_EQ(error_in(std::string("a\n1\0x\n", 6)), "t.csv:2: column \"a\": '1\\0x' is not a number");
}

}  // namespace
