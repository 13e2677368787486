#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "llmt/arrow.hpp"
#include "llmt/commands.hpp"
#include "llmt/csv.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

struct TableArguments {
  std::vector<std::string> data;
  std::string output;
  DecimalMark mark = DecimalMark::point;
  bool thousands = false;
};

// The rows of several CSV files, one file behind the other.
class CsvRows {
 public:
  explicit CsvRows(const TableArguments& arguments) : arguments_(arguments) { open(); }

  const std::vector<std::string>& columns() const { return columns_; }

  std::optional<Eigen::MatrixXd> next() {
    while (true) {
      if (std::optional<Csv> piece = take()) {
        if (arguments_.thousands) piece->read_thousands();
        return piece->numbers_or_missing(columns_, 1);
      }
      if (at_ + 1 == arguments_.data.size()) return std::nullopt;
      ++at_;
      open();
    }
  }

 private:
  void open() {
    const std::string& path = arguments_.data[at_];
    file_ = std::make_unique<std::ifstream>(path, std::ios::binary);
    if (!*file_) throw std::runtime_error(fmt::format("{}: cannot be read", path));
    pieces_ = std::make_unique<CsvPieces>(*file_, path, std::size_t{1} << 22, arguments_.mark);
    first_ = pieces_->next();
    if (!first_) return;
    if (columns_.empty()) columns_ = first_->columns();
    if (first_->columns() != columns_) {
      throw std::runtime_error(fmt::format("{}: the columns are {}, those of {} are {}", path,
                                           csv_row(first_->columns()), arguments_.data.front(), csv_row(columns_)));
    }
  }

  std::optional<Csv> take() {
    if (!first_) return pieces_->next();
    return std::exchange(first_, std::nullopt);
  }

  const TableArguments& arguments_;
  std::size_t at_ = 0;
  std::vector<std::string> columns_;
  std::unique_ptr<std::ifstream> file_;
  std::unique_ptr<CsvPieces> pieces_;
  std::optional<Csv> first_;  // read for its columns
};

void table_command(const TableArguments& arguments) {
  if (arguments.output.empty()) throw std::invalid_argument("-o FILE.arrow is required");
  CsvRows rows(arguments);
  if (rows.columns().empty()) throw std::runtime_error(fmt::format("{}: there are no rows", arguments.data.front()));
  const Eigen::Index count = write_arrow(arguments.output, rows.columns(), [&] { return rows.next(); });
  print(fmt::format("{} rows, {} columns written to {}\n", count, rows.columns().size(), arguments.output));
}

}  // namespace

void add_table(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "table",
      "Write tables as an Arrow file\n"
      "All columns must hold numbers; empty cells are missing values. The file is not compressed, and fit and predict "
      "read it piece by piece, so it need not fit into memory. Several files, which must have the same columns, become "
      "one table.");
  command->footer("Example: llmt table january.csv february.csv -o year.arrow");
  const auto arguments = std::make_shared<TableArguments>();
  command->add_option("data", arguments->data, "CSV files with a header row")->required()->type_name("FILE ...");
  add_output_file(*command, "-o,--output", arguments->output, "Arrow file to write (required)");
  add_decimal_comma(*command, arguments->mark);
  add_thousands(*command, arguments->thousands);
  command->callback([arguments] { table_command(*arguments); });
}

}  // namespace llmt::apps
