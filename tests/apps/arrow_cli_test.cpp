// Arrow files and what is taken for one: messages, limits of the system, states to go on from.
#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>

#include "apps/programs.hpp"
#include "llmt/arrow.hpp"
#include "llmt/files.hpp"
#include "llmt/random.hpp"
#include "oracles/arrow_files.hpp"
#include "oracles/state_files.hpp"

namespace {

using program::Folder;
using program::Outcome;

using program::llmt_program;

// Rows of a kink.
std::string rows_of(int first, int count) {
  std::string text = "a,b,y\n";
  for (int i = first; i < first + count; ++i) {
    const double a = 0.001 * ((i * 7919) % 2003) - 1.0;
    text += fmt::format("{},{},{}\n", a, 0.001 * ((i * 104729) % 1999), 2.0 * std::abs(a) + 0.01 * (i % 7));
  }
  return text;
}

void expect_refusal(const Outcome& outcome, int exit_code, const std::string& text) {
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
  EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
}

TEST(ArrowProgram, AFileThatIsNotThereIsSaidBeforeItsOptions) {
  const Folder folder;
  for (const char* option : {"--memory 1G", "--checkpoint state", "--checkpoint state --resume"}) {
    expect_refusal(folder.run(fmt::format("{} fit nowhere.arrow -t y {}", llmt_program, option)), 1,
                   "nowhere.arrow: cannot be read: No such file or directory");
  }
}

TEST(ArrowProgram, DatesAreLeftOutAsThoseOfTextAre) {
  const Folder folder;
  folder.write("d.arrow", arrow_files::dated_rows());
  const std::string said =
      "llmt: column \"when\" has dates, 24 different ones in 24 rows, and is left out; give a number, as days; "
      "--inputs "
      "takes it for categories\n";
  const Outcome fitted = folder.run(llmt_program + " fit d.arrow -t y -o m.json");
  EXPECT_EQ(fitted.exit_code, 0);
  EXPECT_EQ(fitted.err, said);
  const Outcome ignored = folder.run(llmt_program + " fit d.arrow -t y --ignore when -o plain.json");
  EXPECT_EQ(ignored.err, "");
  EXPECT_EQ(llmt::read_file(folder.file("m.json")), llmt::read_file(folder.file("plain.json")));
  EXPECT_EQ(folder.run(llmt_program + " predict m.json d.arrow -o p.csv").exit_code, 0);
  const Outcome compared = folder.run(llmt_program + " compare d.arrow -t y");
  EXPECT_EQ(compared.exit_code, 0);
  EXPECT_EQ(compared.err, said);
  const Outcome asked = folder.run(llmt_program + " fit d.arrow -t y --inputs when,x -o c.json");
  EXPECT_EQ(asked.err, "");
  EXPECT_NE(llmt::read_file(folder.file("c.json")).find("2024-02-29"), std::string::npos);
  expect_refusal(folder.run(llmt_program + " fit d.arrow -t when"), 1, "column \"when\" holds no numbers");
}

TEST(ArrowProgram, DatesOfFewDaysAreSaidAsThoseOfTextAre) {
  const Folder folder;
  std::string file = arrow_files::dated_rows();
  const std::size_t first = file.find(std::string("\x33\x4d\0\0\x34\x4d\0\0", 8));  // 32-bit days, 24 in a row
  ASSERT_NE(first, std::string::npos);
  for (std::size_t row = 0; row < 24; ++row) file[first + 4 * row] = static_cast<char>('\x33' + row % 3);
  folder.write("d.arrow", file);
  const std::string said =
      "llmt: column \"when\" has words, 3 different ones in 24 rows, and is taken for categories; it looks like a "
      "date: "
      "leave it out (--ignore when) or give a number, as days; --inputs says that categories are meant\n";
  for (const char* command : {"fit d.arrow -t y -o m.json", "compare d.arrow -t y"}) {
    const Outcome outcome = folder.run(llmt_program + " " + command);
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_EQ(outcome.err, said) << command;
  }
  EXPECT_EQ(folder.run(llmt_program + " fit d.arrow -t y --inputs when,x -o m.json").err, "");
}

TEST(ArrowProgram, TablesOfOtherFormatsAreNamed) {
  const Folder folder;
  const std::string zeros(100, '\0');
  folder.write("t.arrows", "\xFF\xFF\xFF\xFF" + zeros);
  folder.write("t.feather", "FEA1" + zeros);
  folder.write("t.parquet", "PAR1\x15\x04" + zeros);
  folder.write("good.csv", rows_of(0, 200));
  ASSERT_EQ(folder.run(llmt_program + " fit good.csv -t y --cv 0 -o m.json").exit_code, 0);
  for (const auto& [name, what] : {std::pair{"t.arrows", "an Arrow stream"},
                                   {"t.feather", "a Feather file of version 1"},
                                   {"t.parquet", "a Parquet file"}}) {
    const std::string message =
        fmt::format("{}: this is {}, a table of text or an uncompressed Arrow file", name, what);
    expect_refusal(folder.run(fmt::format("{} fit {} -t y", llmt_program, name)), 1, message);
    expect_refusal(folder.run(fmt::format("{} fit good.csv {} -t y", llmt_program, name)), 1, message);
    expect_refusal(folder.run(fmt::format("{} predict m.json {}", llmt_program, name)), 1, message);
    expect_refusal(folder.run(fmt::format("{} table {} -o o.arrow", llmt_program, name)), 1, message);
  }
}

// Of 40 files with at most 24 open.
TEST(ArrowProgram, MoreFilesThanMayBeOpenAreFitted) {
  const Folder folder;
  std::string all;
  std::string texts;
  for (int k = 0; k < 40; ++k) {
    folder.write(fmt::format("{}.csv", k), rows_of(20 * k, 20));
    ASSERT_EQ(folder.run(fmt::format("{0} table {1}.csv -o {1}.arrow", llmt_program, k)).exit_code, 0);
    all += fmt::format(" {}.arrow", k);
    texts += fmt::format(" {}.csv", k);
  }
  folder.write("whole.csv", rows_of(0, 800));
  ASSERT_EQ(folder.run(llmt_program + " fit whole.csv -t y -o whole.json").exit_code, 0);
  const std::string few = "ulimit -n 24; " + llmt_program;
  const Outcome fit = folder.run(few + " fit" + all + " -t y -o parts.json");
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_EQ(llmt::read_file(folder.file("parts.json")), llmt::read_file(folder.file("whole.json")));
  ASSERT_EQ(folder.run(few + " predict whole.json" + all + " -o parts.csv").exit_code, 0);
  ASSERT_EQ(folder.run(few + " table" + all + " -o all.arrow").exit_code, 0);
  // Tables of text are kept in files without a name, which must stay open.
  const Outcome refused = folder.run(few + " fit" + texts + " -t y");
  expect_refusal(refused, 1, "Too many open files");
  EXPECT_NE(refused.err.find(".csv: "), std::string::npos) << refused.err;
  ASSERT_EQ(folder.run(few + " table" + texts + " -o all.arrow").exit_code, 0);
}

TEST(ArrowProgram, AFolderForTemporaryFilesThatIsNotThereIsNamed) {
  const Folder folder;
  folder.write("a.csv", rows_of(0, 50));
  folder.write("b.csv", rows_of(50, 50));
  expect_refusal(folder.run("TMPDIR=no/such " + llmt_program + " fit a.csv b.csv -t y"), 1,
                 "a.csv: its rows cannot be kept in no/such, the folder for temporary files (TMPDIR): No such file");
}

// 20 000 columns, of which 65 536 rows would be 10 GB.
TEST(ArrowProgram, FewRowsOfManyColumnsTakeLittleMemory) {
  const Folder folder;
  std::string text;
  for (int k = 0; k < 20000; ++k) text += fmt::format("{}c{}", k == 0 ? "" : ",", k);
  for (int row = 0; row < 2; ++row) {
    text += "\n";
    for (int k = 0; k < 20000; ++k) text += fmt::format("{}{}", k == 0 ? "" : ",", k + row);
  }
  folder.write("wide.csv", text + "\n");
  const std::string small = "ulimit -v 500000; " + llmt_program;
  ASSERT_EQ(folder.run(small + " table wide.csv -o wide.arrow").exit_code, 0);
  const Outcome again = folder.run(small + " table wide.arrow -o again.arrow");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(llmt::read_file(folder.file("again.arrow")), llmt::read_file(folder.file("wide.arrow")));
}

// Twice the columns take at most about twice the time; with a search among all columns for each it was four times, 14
// s.
TEST(ArrowProgram, AHundredThousandColumnsAreReadInTime) {
  const Folder folder;
  std::vector<std::string> columns = {"y", "a"};
  for (int k = 2; k < 100000; ++k) columns.push_back(fmt::format("c{}", k));
  int given = 0;
  llmt::write_arrow(folder.file("t.arrow"), columns, [&]() -> std::optional<Eigen::MatrixXd> {
    if (given++ > 0) return std::nullopt;
    return Eigen::MatrixXd::Random(2, 100000);
  });
  folder.write("good.csv", rows_of(0, 200));
  ASSERT_EQ(folder.run(llmt_program + " fit good.csv -t y --inputs a --cv 0 -o m.json").exit_code, 0);
  for (const char* command : {"table t.arrow -o o.arrow", "predict m.json t.arrow -o p.csv"}) {
    // Processor seconds.
    const Outcome outcome = folder.run(fmt::format("ulimit -t 4; {} {}", llmt_program, command));
    EXPECT_EQ(outcome.exit_code, 0) << command << ": " << outcome.err;
  }
}

// Sets a word of eight bytes of a state and gives it the checksum that goes with it.
std::string with_word(const std::string& state, std::size_t word, std::int64_t value) {
  std::string content = state_files::content(state);
  std::memcpy(content.data() + 8 * word, &value, sizeof value);
  return state_files::sealed_as(state, content);
}

TEST(ArrowProgram, AStateThatIsWrongIsNamed) {
  const Folder folder;
  folder.write("d.csv", rows_of(0, 3000));
  ASSERT_EQ(folder.run(llmt_program + " table d.csv -o d.arrow").exit_code, 0);
  const std::string fit = llmt_program + " fit d.arrow -t y --memory 100K --cv 0 --checkpoint ";
  const std::vector<std::string> states = state_files::split(folder.run(fit + "/dev/stdout | cat").out);
  ASSERT_GE(states.size(), 3);
  for (const std::size_t k : {std::size_t{0}, states.size() / 2, states.size() - 1}) {
    folder.write("state", states[k]);
    EXPECT_EQ(folder.run(fit + "state --resume").exit_code, 0) << k;
    // The first words are options, columns, counts and the like; among them is one of each kind of error.
    int refused = 0;
    for (std::size_t word = 0; word < 40; word += 3) {
      folder.write("state", with_word(states[k], word, std::int64_t{1} << 40));
      const Outcome outcome = folder.run(fit + "state --resume");
      if (outcome.exit_code == 0) continue;
      ++refused;
      expect_refusal(outcome, 1, "llmt: state: ");
    }
    EXPECT_GT(refused, 7) << k;
  }
}

}  // namespace
