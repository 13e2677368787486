#include "shared/table_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <stdexcept>
#include <unordered_set>
#include <utility>

#include "llmt/files.hpp"
#include "llmt/training_data.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

constexpr std::size_t text_at_once = std::size_t{1} << 22;

// The numbers of a CSV file as an Arrow file that nobody else sees.
ArrowTable as_arrow(const std::string& path, NumberFormat format) {
  RowsInOrder rows({path}, format);
  if (rows.columns().empty()) throw std::runtime_error(fmt::format("{}: there is a header and no rows", path));
  return ArrowTable::hold(path, rows.columns(), [&] { return rows.next(); });
}

ArrowTable open_table(const std::string& path, NumberFormat format) {
  return is_arrow_file(path) ? ArrowTable::open(path) : as_arrow(path, format);
}

// The first of `names` that is not among `others`.
const std::string* first_missing(const std::vector<std::string>& names, const std::vector<std::string>& others) {
  const std::unordered_set<std::string> known(others.begin(), others.end());
  const auto found = std::ranges::find_if(names, [&](const std::string& name) { return !known.contains(name); });
  return found == names.end() ? nullptr : &*found;
}

}  // namespace

RowsInOrder::RowsInOrder(std::vector<std::string> paths, NumberFormat format)
    : paths_(std::move(paths)), format_(format) {
  open();
}

void RowsInOrder::open() {
  const std::string& path = paths_[at_];
  pieces_.reset();
  table_.reset();
  std::vector<std::string> columns;
  if (is_arrow_file(path)) {
    table_ = ArrowTable::open(path);
    row_ = 0;
    columns = table_->columns();
  } else {
    text_ = std::ifstream(path, std::ios::binary);
    if (!text_) throw std::runtime_error(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
    pieces_.emplace(text_, path, text_at_once, format_.mark);
    first_ = pieces_->next();
    if (!first_) return;
    columns = first_->columns();
  }
  if (columns_.empty()) columns_ = columns;
  if (columns != columns_) {
    throw std::runtime_error(fmt::format("{}: the columns are {}, those of {} are {}", path, csv_row(columns),
                                         paths_.front(), csv_row(columns_)));
  }
}

std::optional<Eigen::MatrixXd> RowsInOrder::next_of_file() {
  if (table_) {
    const Eigen::Index count = std::min(arrow_rows_at_once(columns_.size()), table_->rows() - row_);
    if (count == 0) return std::nullopt;
    row_ += count;
    return table_->read(row_ - count, count, columns_);
  }
  std::optional<Csv> piece = first_ ? std::exchange(first_, std::nullopt) : pieces_->next();
  if (!piece) return std::nullopt;
  if (format_.thousands) piece->read_thousands();
  return piece->numbers_or_missing(columns_, 1);
}

std::optional<Eigen::MatrixXd> RowsInOrder::next() {
  while (true) {
    if (std::optional<Eigen::MatrixXd> rows = next_of_file()) return rows;
    if (at_ + 1 == paths_.size()) return std::nullopt;
    ++at_;
    open();
  }
}

TableFiles::TableFiles(const std::vector<std::string>& paths, NumberFormat format) {
  for (const std::string& path : paths) {
    files_.push_back({path, open_table(path, format), rows_});
    rows_ += files_.back().table.rows();
    const auto refuse_column = [&](const std::string* column, const std::string& has_not, const std::string& has) {
      if (column == nullptr) return;
      throw std::runtime_error(fmt::format("{}: there is no column \"{}\", which {} has", has_not, *column, has));
    };
    const std::vector<std::string>& own = files_.back().table.columns();
    refuse_column(first_missing(columns(), own), path, paths.front());
    refuse_column(first_missing(own, columns()), paths.front(), path);
  }
}

std::string TableFiles::name() const {
  const std::size_t more = files_.size() - 1;
  return more == 0 ? files_.front().path
                   : fmt::format("{} and {} more file{}", files_.front().path, more, more == 1 ? "" : "s");
}

Eigen::MatrixXd TableFiles::read(Eigen::Index first, Eigen::Index count, const std::vector<std::string>& columns,
                                 const std::vector<std::vector<std::string>>& levels) const {
  std::vector<std::string> numbers;
  std::vector<Eigen::Index> places;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (k < levels.size() && !levels[k].empty()) continue;
    numbers.push_back(columns[k]);
    places.push_back(static_cast<Eigen::Index>(k));
  }
  Eigen::MatrixXd rows(count, std::ssize(columns));
  for (const File& file : files_) {
    const Eigen::Index begin = std::max(first, file.first);
    const Eigen::Index end = std::min(first + count, file.first + file.table.rows());
    if (begin >= end) continue;
    auto part = rows.middleRows(begin - first, end - begin);
    part(Eigen::all, places) = file.table.read(begin - file.first, end - begin, numbers);
    for (std::size_t k = 0; k < levels.size(); ++k) {
      if (levels[k].empty()) continue;
      for (Eigen::Index row = begin; row < end; row += arrow_rows_at_once(1)) {
        const Eigen::Index few = std::min(arrow_rows_at_once(1), end - row);
        part.col(static_cast<Eigen::Index>(k)).segment(row - begin, few) =
            category_values(file.table.texts(row - file.first, few, columns[k]), levels[k]);
      }
    }
  }
  return rows;
}

TableFiles::DifferentWords TableFiles::different_words(const std::string& column, std::size_t most) const {
  std::set<std::string> words;
  for (const File& file : files_) {
    for (Eigen::Index first = 0; first < file.table.rows(); first += arrow_rows_at_once(1)) {
      const Eigen::Index count = std::min(arrow_rows_at_once(1), file.table.rows() - first);
      for (std::string& word : file.table.texts(first, count, column)) {
        if (!word.empty()) words.insert(std::move(word));
      }
      if (words.size() > most) return {{words.begin(), words.end()}, false};
    }
  }
  for (const std::string& word : words) {
    try {
      Json(word).dump();
    } catch (const Json::exception&) {
      throw std::runtime_error(fmt::format("{}: column \"{}\" has words that are not UTF-8", name(), column));
    }
  }
  return {{words.begin(), words.end()}, true};
}

std::vector<std::vector<std::string>> TableFiles::levels(const std::vector<std::string>& columns,
                                                         std::size_t most) const {
  std::vector<std::vector<std::string>> levels(columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const bool is_text = has_text(columns[k]);
    for (const File& file : files_) {
      if (file.table.has_text(columns[k]) == is_text) continue;
      throw std::runtime_error(fmt::format("{}: column \"{}\" holds {}, and {} in {}", file.path, columns[k],
                                           is_text ? "numbers" : "text", is_text ? "text" : "numbers",
                                           files_.front().path));
    }
    if (!is_text) {
      require_numbers({columns[k]});
      continue;
    }
    DifferentWords found = different_words(columns[k], most);
    if (!found.are_all) {
      throw std::runtime_error(fmt::format("{}: column \"{}\" has more than {} different words; --ignore leaves it out",
                                           name(), columns[k], most));
    }
    levels[k] = std::move(found.words);
    if (levels[k].empty()) levels[k] = {"(none)"};  // as of a column of a CSV file
  }
  return levels;
}

void TableFiles::require_numbers(const std::vector<std::string>& columns) const {
  for (const File& file : files_) file.table.read(0, 0, columns);
}

void TableFiles::check_kinds(const std::vector<std::string>& columns,
                             const std::vector<std::vector<std::string>>& levels) const {
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (levels[k].empty()) {
      require_numbers({columns[k]});
      continue;
    }
    for (const File& file : files_) {
      if (file.table.has_text(columns[k])) continue;
      throw std::runtime_error(
          fmt::format("{}: column \"{}\" holds no text, and is a category of the model", file.path, columns[k]));
    }
  }
}

const TableFiles::File& TableFiles::file_of(Eigen::Index row) const {
  auto file = std::ranges::upper_bound(files_, row, {}, &File::first);
  return *std::prev(file);
}

void TableFiles::refuse(Eigen::Index row, const std::string& column, const std::string& reason) const {
  const File& file = file_of(row);
  throw std::runtime_error(
      fmt::format("{}: row {}: column \"{}\": {}", file.path, row - file.first + 1, column, reason));
}

}  // namespace llmt::apps
