#include <fmt/format.h>

#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "llmt/arrow.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/table_files.hpp"
#include "trees/commands.hpp"

namespace llmt::apps {
namespace {

struct TableArguments {
  std::vector<std::string> data;
  std::string output;
  Eigen::Index every = 1;
  NumberFormat format;
};

// Every so many rows of all that are given, the first one among them.
class SomeRows {
 public:
  explicit SomeRows(Eigen::Index every) : every_(every) {}

  Eigen::MatrixXd of(const Eigen::MatrixXd& rows) {
    std::vector<Eigen::Index> kept;
    for (Eigen::Index row = skip_; row < rows.rows(); row += every_) kept.push_back(row);
    skip_ += std::ssize(kept) * every_ - rows.rows();
    return rows(kept, Eigen::all);
  }

 private:
  Eigen::Index every_;
  Eigen::Index skip_ = 0;  // rows before the next one
};

void table_command(const TableArguments& arguments) {
  if (arguments.output.empty()) throw std::invalid_argument("-o FILE.arrow is required");
  RowsInOrder rows(arguments.data, arguments.format);
  SomeRows some(arguments.every);
  if (rows.columns().empty()) throw std::runtime_error(fmt::format("{}: there are no rows", arguments.data.front()));
  const Eigen::Index count = write_arrow(arguments.output, rows.columns(), [&]() -> std::optional<Eigen::MatrixXd> {
    const std::optional<Eigen::MatrixXd> given = rows.next();
    if (!given) return std::nullopt;
    return some.of(*given);
  });
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
  add_input_files(*command, "data", arguments->data, "CSV files with a header row, or Arrow files")->required();
  add_output_file(*command, "-o,--output", arguments->output, "Arrow file to write (required)");
  add_count(*command, "--every", arguments->every, Eigen::Index{1}, "Write every so many rows alone",
            Eigen::Index{1'000'000'000})
      ->capture_default_str();
  add_decimal_comma(*command, arguments->format.mark);
  add_thousands(*command, arguments->format.thousands);
  command->callback([arguments] { table_command(*arguments); });
}

}  // namespace llmt::apps
