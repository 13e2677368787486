// Arrow files: footers and batches that say more than the file has, many columns, and files with changed bytes.
#include <fmt/format.h>

#include <array>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "hostile/lists.hpp"
#include "llmt/arrow.hpp"
#include "llmt/random.hpp"
#include "oracles/arrow_edit.hpp"
#include "oracles/arrow_files.hpp"

namespace hostile {
namespace {

std::string file_of(const std::vector<std::string>& columns, Eigen::Index rows) {
  bool is_given = false;
  llmt::Random random(2);
  llmt::write_arrow("made.arrow", columns, [&]() -> std::optional<Eigen::MatrixXd> {
    if (std::exchange(is_given, true)) return std::nullopt;
    Eigen::MatrixXd values(rows, std::ssize(columns));
    for (Eigen::Index k = 0; k < values.size(); ++k) values.data()[k] = random.uniform();
    return values;
  });
  return read("made.arrow");
}

std::vector<std::string> many_columns(int count) {
  std::vector<std::string> columns = {"y"};
  for (int k = 1; k < count; ++k) columns.push_back(fmt::format("c{}", k));
  return columns;
}

// The file with a number of its metadata that is replaced.
template <class T>
std::string with_number(std::string file, std::size_t at, T value) {
  arrow_edit::set(file, at, value);
  return file;
}

// Bytes and numbers are replaced, or the end is cut off.
std::string changed_file(std::string file, llmt::Random& random) {
  const auto below = [&](std::size_t count) { return random.below(count); };
  constexpr std::array<std::int64_t, 10> numbers = {0,
                                                    1,
                                                    -1,
                                                    8,
                                                    255,
                                                    65536,
                                                    1 << 30,
                                                    std::int64_t{1} << 40,
                                                    std::numeric_limits<std::int64_t>::max(),
                                                    std::numeric_limits<std::int64_t>::min()};
  const std::size_t changes = 1 + below(3);
  for (std::size_t k = 0; k < changes; ++k) {
    const std::size_t at = below(file.size());
    const std::size_t kind = below(8);
    if (kind == 0) file.resize(std::max<std::size_t>(at, 1));
    if (kind == 1 || kind == 2) file[at] = static_cast<char>(below(256));
    if (kind == 3 || kind == 4) file[at] = static_cast<char>(file[at] ^ (1 << below(8)));
    if (kind >= 5) {
      const std::int64_t number = numbers[below(numbers.size())];
      const std::size_t place = at / 4 * 4;
      if (place + 8 <= file.size()) arrow_edit::set(file, place, number);
    }
  }
  return file;
}

}  // namespace

void ask_arrow_files(List& list, const std::string& program) {
  using Command = std::vector<std::string>;
  const std::string good = file_of({"a", "b", "y"}, 300);
  write("good.arrow", good);
  const Outcome fitted = run({program, "fit", "good.arrow", "-t", "y", "-o", "model.json"}, {.seconds = 60.0});
  if (fitted.exit_code != 0) throw std::runtime_error("no base model: " + fitted.err);
  const Command fit = {program, "fit", "evil.arrow", "-t", "y", "--max-leaves", "4"};
  const std::vector<std::pair<std::string, Command>> uses = {
      {"fit", fit},
      {"predict", {program, "predict", "model.json", "evil.arrow", "-o", "out.csv"}},
      {"table", {program, "table", "evil.arrow", "-o", "out.arrow"}},
      {"compare", {program, "compare", "evil.arrow", "-t", "y", "--cv", "2", "--max-leaves", "2"}}};
  const auto ask = [&](const std::string& name, const std::string& bytes) {
    write("evil.arrow", bytes);
    for (const auto& [use, command] : uses) list.ask(fmt::format("{}: {}", name, use), command, "evil.arrow");
  };
  ask("a file", good);
  const std::string wide = file_of(many_columns(3001), 1);
  const std::string tall = file_of({"a", "b", "y"}, 65000);
  for (const std::uint32_t count : {2U, 2000U, 20000U}) {
    ask(fmt::format("3001 columns, a batch named {} times", count), arrow_edit::with_repeated_batch(wide, count));
  }
  ask("65 000 rows, a batch named 300 000 times", arrow_edit::with_repeated_batch(tall, 300000));
  ask("a batch named 11 000 000 times", arrow_edit::with_repeated_batch(good, 11'000'000));
  const std::size_t entry = arrow_edit::batches(good);
  const std::size_t batch = arrow_edit::header(good, entry);
  const std::size_t nodes = arrow_edit::vector(good, batch, 1);
  const std::size_t buffers = arrow_edit::vector(good, batch, 2);
  constexpr std::int64_t huge = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t rows : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{301}, std::int64_t{100000}, huge}) {
    std::string file = with_number(good, arrow_edit::field(good, batch, 0), rows);
    for (std::size_t column = 0; column < 3; ++column) arrow_edit::set(file, nodes + 16 * column, rows);
    ask(fmt::format("{} rows in a batch of 300", rows), file);
    for (std::size_t column = 0; column < 3; ++column) {
      file = with_number(file, arrow_edit::column_field(file, column, 2), std::uint8_t{6});
    }
    ask(fmt::format("{} rows of bits", rows), file);
  }
  std::string shared = good;
  for (std::size_t k = 0; k < 6; ++k) arrow_edit::set(shared, buffers + 16 * k, std::int64_t{0});
  ask("all columns in the same bytes", shared);
  for (const std::int64_t value : {std::int64_t{-8}, std::int64_t{4}, huge}) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t place = entry + (k == 1 ? 8 : 8 * k);
      ask(fmt::format("entry of a batch, number {} is {}", k, value),
          k == 1 ? with_number(good, place, static_cast<std::int32_t>(value)) : with_number(good, place, value));
    }
    ask(fmt::format("a buffer begins at {}", value), with_number(good, buffers + 16, value));
    ask(fmt::format("a buffer has {} bytes", value), with_number(good, buffers + 24, value));
    ask(fmt::format("{} values are missing", value), with_number(good, nodes + 8, value));
  }
  for (const std::int32_t length : {-1, 0, 8, (1 << 28) + 1, std::numeric_limits<std::int32_t>::max()}) {
    ask(fmt::format("a footer of {} bytes", length), with_number(good, arrow_edit::footer_length(good), length));
  }
  for (const std::string& begin : {std::string("\xFF\xFF\xFF\xFF\x78\0\0\0", 8), std::string("FEA1\0\0\0\0", 8),
                                   std::string("PAR1\x15\x04"), std::string("ARROW1\0\0", 8), std::string("ARROW1")}) {
    ask("no file that begins with " + begin.substr(0, 4), begin + std::string(200, '\0') + "\n");
  }
  const std::string broad = file_of(many_columns(100000), 2);
  write("evil.arrow", broad);
  list.ask("100 000 columns: table", {program, "table", "evil.arrow", "-o", "out.arrow"}, "evil.arrow");
  list.ask("100 000 columns: predict", {program, "predict", "model.json", "evil.arrow"}, "evil.arrow");
  llmt::Random random(57);
  const std::array<std::string, 4> bases = {good, arrow_files::words(), arrow_files::numbers(),
                                            arrow_edit::with_repeated_batch(good, 1)};
  for (int k = 0; k < 400; ++k) {
    const std::string bytes = changed_file(bases[static_cast<std::size_t>(k) % bases.size()], random);
    write("evil.arrow", bytes);
    const auto& [use, command] = uses[random.below(uses.size())];
    list.ask(fmt::format("changed bytes {}: {}", k, use), command, "evil.arrow");
  }
}

}  // namespace hostile
