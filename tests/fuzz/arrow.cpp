// Arrow files: a damaged one is refused by its name, or read the same as a whole and in pieces. Inputs that begin as a
// file does are files as they stand; others change bytes of one that was written.
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>

#include "fuzz/fuzz.hpp"
#include "llmt/arrow.hpp"
#include "llmt/files.hpp"
#include "oracles/arrow_files.hpp"

namespace fuzz_arrow {
namespace {

const std::vector<std::string> names = {"a", "b", ""};

// A file of this process alone.
const std::string& path() {
  static const std::string name = [] {
    std::string text = "/tmp/llmt_fuzz_arrow_XXXXXX";
    const int file = ::mkstemp(text.data());
    fuzz::require(file >= 0, "a temporary file can be made");
    ::close(file);
    std::atexit([] { ::unlink(path().c_str()); });
    return text;
  }();
  return name;
}

// Three batches, with missing values.
const std::string& written() {
  static const std::string bytes = [] {
    int batch = 0;
    llmt::write_arrow(path(), names, [&]() -> std::optional<Eigen::MatrixXd> {
      if (batch == 3) return std::nullopt;
      ++batch;
      Eigen::MatrixXd rows = Eigen::MatrixXd::Constant(4 + batch, 3, 0.5 * batch);
      rows(2, 1) = std::nan("");
      return rows;
    });
    return llmt::read_file(path());
  }();
  return bytes;
}

// Bytes are set, numbers of four and eight bytes too, and the end is cut off.
std::string changed(fuzz::Bytes& bytes) {
  std::string file = bytes.coin() ? written() : arrow_files::words();
  while (!bytes.empty() && !file.empty()) {
    const auto at = static_cast<std::size_t>(bytes.below(65536)) % file.size();
    switch (bytes.below(8)) {
      case 0:
        file.resize(at);
        break;
      case 1: {
        const std::int64_t number =
            bytes.coin() ? bytes.below(256) : std::numeric_limits<std::int64_t>::max() >> bytes.below(64);
        std::memcpy(file.data() + at, &number, std::min(sizeof number, file.size() - at));
        break;
      }
      default:
        file[at] = static_cast<char>(bytes.byte());
    }
  }
  return file;
}

bool same(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.size() == b.size() && (a.size() == 0 || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

void read_text(const llmt::ArrowTable& table, Eigen::Index rows, const std::string& column) {
  const std::vector<std::string> whole = table.texts(0, rows, column);
  fuzz::require(std::ssize(whole) == rows, "there are as many texts as were asked for");
  const std::vector<std::string> later = table.texts(rows / 2, rows - rows / 2, column);
  fuzz::require(std::equal(later.begin(), later.end(), whole.begin() + rows / 2), "a piece is a piece of the whole");
}

void read_all(const llmt::ArrowTable& table) {
  constexpr Eigen::Index most_rows = 1000;  // a column without values may claim any number
  const Eigen::Index rows = std::min(table.rows(), most_rows);
  for (const std::string& column : table.columns()) {
    const std::vector<std::string> one = {column};
    try {
      if (table.has_text(column)) {
        read_text(table, rows, column);
        continue;
      }
      const Eigen::MatrixXd whole = table.read(0, rows, one);
      fuzz::require(whole.rows() == rows && whole.cols() == 1, "there are as many rows as were asked for");
      const Eigen::MatrixXd later = table.read(rows / 2, rows - rows / 2, one);
      fuzz::require(same(later, whole.bottomRows(rows - rows / 2)), "a piece is a piece of the whole");
    } catch (const std::runtime_error& error) {
      fuzz::require(std::string(error.what()).starts_with(path() + ": "),
                    fmt::format("'{}' names the file", error.what()));
    }
  }
}

}  // namespace

FUZZ_TARGET(arrow) {
  std::string file = fuzz::text_of(data, size);
  fuzz::Bytes bytes(data, size);
  if (!file.starts_with("ARROW1")) file = changed(bytes);
  llmt::write_file(path(), file);
  try {
    read_all(llmt::ArrowTable::open(path()));
  } catch (const std::runtime_error& error) {
    fuzz::require(std::string(error.what()).starts_with(path() + ": "),
                  fmt::format("'{}' names the file", error.what()));
  }
  return 0;
}

}  // namespace fuzz_arrow
