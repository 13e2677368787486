// Tables at random, with all that a table may have and much that it may not, against a parser that is slow and obvious.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <optional>
#include <regex>

#include "llmt/csv.hpp"
#include "llmt/random.hpp"
#include "oracles/naive_csv.hpp"

namespace {

using namespace oracle::csv;

class Writer {
 public:
  Writer(std::uint64_t seed, bool commas) : random_(seed), commas_(commas) {}

  std::string text() {
    separator_ = pick({",", ",", ";", "\t"})[0];
    line_end_ = pick({"\n", "\r\n"});
    faults_ = chance(0.5) ? 0.0 : 0.02;
    std::string text = chance(0.3) ? "\xEF\xBB\xBF" : "";
    const std::size_t width = 1 + random_.below(5);
    const std::size_t rows = random_.below(12);
    for (std::size_t row = 0; row <= rows; ++row) {
      if (chance(0.1)) text += pick({"", " ", "\t ", "  "}) + line_end_;
      const std::size_t fields = width + (chance(faults_) ? 1 : 0);
      for (std::size_t field = 0; field < fields; ++field) {
        if (field > 0) text += separator_;
        text += padded(row == 0 ? name(field) : cell());
      }
      if (row < rows || chance(0.7)) text += line_end_;
    }
    if (chance(faults_)) text.resize(random_.below(text.size() + 1));
    for (char& c : text) {
      if (chance(0.05 * faults_)) c = pick({",", "\"", "\n", "\r", " ", "\t", ";", "-", "+", "1", ".", "e"})[0];
    }
    return text;
  }

 private:
  bool chance(double probability) { return random_.uniform() < probability; }
  std::string pick(const std::vector<std::string>& choices) { return choices[random_.below(choices.size())]; }
  std::string padded(const std::string& text) {
    // A tab is a separator in some tables.
    return chance(0.8) ? text : pick({"", " ", "  "}) + text + pick({"", " ", "\r"});
  }
  std::string name(std::size_t field) {
    const std::string plain = chance(faults_) ? pick({"", "c0", "\"\""}) : fmt::format("c{}", field);
    return chance(0.2) ? fmt::format("\"{} \"\"x\"\"{}\"", plain, separator_) : plain;
  }
  std::string cell() {
    const double size = std::pow(10.0, 20.0 * random_.normal());
    const double value = size * random_.normal();
    if (chance(faults_)) {
      return pick({"left",
                   "1.5x",
                   "x1",
                   "nan",
                   "-inf",
                   "Infinity",
                   "1e999",
                   "-1e999",
                   "+-4",
                   "--4",
                   "+",
                   "-",
                   ".",
                   "1e",
                   "1 2",
                   "\"1\" 2",
                   "1\"2\"",
                   "",
                   "NA",
                   " ",
                   "\"\"",
                   "?",
                   "n/a",
                   "Null",
                   "\"nan\"",
                   "0x10",
                   fmt::format("\"a{}b\"", separator_),
                   "\"two\nlines\"",
                   "\"\"\"said\"\"\"",
                   "\"" + line_end_ + "\""});
    }
    std::string number = chance(0.3)
                             ? pick({"0", "-0", "+4", "5.", ".5", "-.5e1", "1E5", "00012", "1e-999", "9007199254740993",
                                     "0.000000000000000000000000000000123456789012345678901234567890"})
                             : fmt::format("{:.{}g}", value, 1 + random_.below(25));
    const bool is_quoted = chance(0.2);
    if ((separator_ != ',' || is_quoted) && commas_ != chance(faults_)) std::ranges::replace(number, '.', ',');
    return is_quoted ? fmt::format("\"{}\"", number) : number;
  }

  llmt::Random random_;
  char separator_ = ',';
  std::string line_end_;
  double faults_ = 0.0;
  bool commas_ = false;
};

template <class Call>
std::string error_of_call(Call call) {
  try {
    call();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

// Equal, NaN to NaN and zeros with their signs.
bool same(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return false;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    const double x = a.data()[i];
    const double y = b.data()[i];
    if (std::isnan(x) ? !std::isnan(y) : (x != y || std::signbit(x) != std::signbit(y))) return false;
  }
  return true;
}

TEST(CsvOracle, RandomTablesReadAsByTheNaiveParser) {
  int read = 0;
  int refused = 0;
  for (std::uint64_t seed = 0; seed < 6000; ++seed) {
    const bool commas = seed % 4 == 3;
    const std::string text = Writer(seed, commas).text();
    SCOPED_TRACE(fmt::format("seed {}:\n{}", seed, text));
    const llmt::DecimalMark mark = commas ? llmt::DecimalMark::comma : llmt::DecimalMark::point;
    const Table expected = naive(text, static_cast<char>(mark));
    std::optional<llmt::Csv> csv;
    ASSERT_EQ(error_of_call([&] { csv.emplace(llmt::Csv::parse(text, "t", mark)); }), expected.error);
    if (!csv) {
      ++refused;
      continue;
    }
    ASSERT_EQ(csv->columns(), expected.columns);
    ASSERT_EQ(csv->rows(), std::ssize(expected.cells));
    std::vector<std::size_t> wanted(1, seed % expected.columns.size());  // one column, then all
    for (int pass = 0; pass < 2; ++pass) {
      std::vector<std::string> names;
      for (const std::size_t field : wanted) names.push_back(expected.columns[field]);
      for (const bool allow_missing : {false, true}) {
        Eigen::MatrixXd values;
        Eigen::MatrixXd expected_values;
        const std::string error =
            naive_numbers(expected, wanted, allow_missing, expected_values, static_cast<char>(mark));
        ASSERT_EQ(error_of_call([&] { values = allow_missing ? csv->numbers_or_missing(names) : csv->numbers(names); }),
                  error);
        if (error.empty()) {
          ASSERT_TRUE(same(values, expected_values));
          ++read;
        } else {
          ++refused;
        }
      }
      for (std::size_t field = 0; field < expected.columns.size(); ++field) wanted.push_back(field);
      wanted.erase(wanted.begin(), wanted.begin() + (pass == 0 ? 1 : 0));
    }
    for (std::size_t field = 0; field < expected.columns.size(); ++field) {
      const std::vector<std::string> texts = csv->texts(expected.columns[field]);
      for (std::size_t row = 0; row < expected.cells.size(); ++row) {
        const std::string& cell = expected.cells[row][field];
        ASSERT_EQ(texts[row], is_missing(cell) ? "" : trimmed(unquoted(cell)));
      }
    }
    std::vector<Eigen::Index> rows;
    std::vector<Eigen::Index> lines;
    for (const Record& record : expected.records) {
      rows.push_back(std::ssize(rows));
      lines.push_back(record.line);
      ASSERT_EQ(csv->line_of(rows.back()), lines.back());
    }
    ASSERT_EQ(csv->lines_of(rows), lines);
  }
  // Both are tried often.
  EXPECT_GT(read, 5000);
  EXPECT_GT(refused, 500);
}

TEST(CsvOracle, ErrorsAndNumbersDoNotDependOnThreads) {
  llmt::Random random(7);
  for (int repeat = 0; repeat < 6; ++repeat) {
    constexpr Eigen::Index rows = 30000;
    Eigen::MatrixXd expected(rows, 3);
    std::string text = "a,b,c\n";
    std::vector<std::size_t> begins;
    for (Eigen::Index row = 0; row < rows; ++row) {
      begins.push_back(text.size());
      for (int column = 0; column < 3; ++column) {
        expected(row, column) = random.normal();
        text += fmt::format("{}{}", expected(row, column), column < 2 ? ',' : '\n');
      }
    }
    const std::vector<std::string> names = {"c", "a", "b", "a"};
    const llmt::Csv good = llmt::Csv::parse(text, "t");
    EXPECT_EQ(good.numbers(names, 1), expected(Eigen::all, {2, 0, 1, 0}));
    EXPECT_EQ(good.numbers(names, 2), expected(Eigen::all, {2, 0, 1, 0}));
    std::size_t first = begins.size();
    for (int fault = 0; fault < 20; ++fault) {
      const std::size_t row = random.below(begins.size());
      text[begins[row]] = 'x';
      first = std::min(first, row);
    }
    const llmt::Csv bad = llmt::Csv::parse(text, "t");
    const std::string error = error_of_call([&] { bad.numbers(names, 1); });
    EXPECT_TRUE(error.starts_with(fmt::format("t:{}: column \"a\": 'x", first + 2))) << error;
    EXPECT_EQ(error_of_call([&] { bad.numbers(names, 2); }), error);
    const llmt::CsvNumbers read = bad.read_numbers(names, 2);
    EXPECT_EQ(read.cells[1].first_other, first);
    EXPECT_EQ(read.cells[1].other, read.values.col(1).array().isNaN().count());
    EXPECT_EQ(read.cells[0].other + read.cells[0].missing, 0);
  }
}

}  // namespace
