#include "llmt/arrow_fit.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "llmt/arrow.hpp"
#include "llmt/csv.hpp"
#include "llmt/distributed.hpp"
#include "llmt/files.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

// Rows are read, and their sums formed, so many blocks at a time.
constexpr Eigen::Index blocks_at_once = 4;

// fit() takes at most about this many times the bytes of a branch's rows, the rows included: 4.5 were measured with ten
// inputs and crisp leaves.
constexpr double bytes_per_byte = 5.0;
// The part of the memory that branches may take; the rest is for sums and the tree.
constexpr double part_for_branches = 0.75;

constexpr std::string_view name_of_step[] = {"describe", "grow", "gather", "finished"};

void refuse_options_of_csv(const CLI::App& command) {
  constexpr std::array<std::string_view, 22> taken = {
      "data",     "target", "inputs",       "ignore",     "cv",        "max-leaves", "min-leaf", "threads",
      "validity", "width",  "jump",         "ridge",      "shrinkage", "estimation", "sparse",   "significance",
      "seed",     "prune",  "no-intervals", "checkpoint", "resume",    "rule"};
  constexpr std::array<std::string_view, 6> more = {"memory", "output", "json", "loss", "local-models", "patience"};
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() > 0 && std::ranges::find(taken, name) == taken.end() &&
        std::ranges::find(more, name) == more.end()) {
      throw std::invalid_argument(fmt::format("--{} is not for Arrow files; give the table as CSV", name));
    }
  }
}

// The rows first ... last - 1.
struct RowRange {
  Eigen::Index first;
  Eigen::Index last;
};

// The blocks of a process are neighbours, so that their sums are few.
RowRange rows_of(const Processes& processes, Eigen::Index rows, Eigen::Index block_rows) {
  const Eigen::Index blocks = (rows + block_rows - 1) / block_rows;
  const auto begin = [&](Eigen::Index rank) { return std::min(rows, blocks * rank / processes.count() * block_rows); };
  return {begin(processes.rank()), begin(processes.rank() + 1)};
}

double memory_of(const ArrowFitArguments& arguments) {
  if (!arguments.memory.empty()) return read_memory(arguments.memory);
  return 0.5 * static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

// Names the row, counted from 1, and the column of what cannot be learned from.
void check_arrow_rows(const ArrowTable& table, const std::vector<std::string>& columns, const Eigen::MatrixXd& rows,
                      Eigen::Index first) {
  for (Eigen::Index j = 0; j < rows.cols(); ++j) {
    const bool is_target = j + 1 == rows.cols();
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const double value = rows(i, j);
      if (std::abs(value) <= largest_magnitude || (std::isnan(value) && !is_target)) continue;
      throw std::runtime_error(fmt::format("{}: row {}: column \"{}\" is {}", table.path(), first + i + 1, columns[j],
                                           std::isnan(value) ? "missing" : fmt::format("{}", value)));
    }
  }
}

// One pass over the rows first ... last - 1, which begin with a block. `columns`: inputs, target.
distributed::Sums sum_rows(const ArrowTable& table, RowRange range, const std::vector<std::string>& columns,
                           const distributed::State& state, Eigen::Index block_rows, int threads, ProgressBar& bar) {
  distributed::Sums all;
  const Eigen::Index inputs = std::ssize(columns) - 1;
  for (Eigen::Index first = range.first; first < range.last; first += blocks_at_once * block_rows) {
    const Eigen::Index count = std::min(blocks_at_once * block_rows, range.last - first);
    const Eigen::MatrixXd rows = table.read(first, count, columns);
    check_arrow_rows(table, columns, rows, first);
    all = merge(std::move(all),
                distributed::sums({rows.leftCols(inputs), rows.col(inputs), first / block_rows}, state, threads));
    bar.show(first + count - range.first, range.last - range.first);
  }
  return all;
}

distributed::State first_state(const ArrowFitArguments& arguments, const std::vector<std::string>& inputs,
                               const distributed::Options& options) {
  const std::string& target = arguments.learning.targets.front();
  distributed::State state = distributed::start(inputs, target, options);
  if (!arguments.resume || !std::filesystem::exists(arguments.checkpoint)) return state;
  distributed::State saved = distributed::State::from_bytes(
      read_file(arguments.checkpoint, {.bytes = std::uintmax_t{1} << 33}), arguments.checkpoint);
  if (!saved.continues(state)) {
    throw std::runtime_error(fmt::format("{}: is of a fit of other columns or with other options, or another --memory",
                                         arguments.checkpoint));
  }
  return saved;
}

void print_result(const ArrowFitArguments& arguments, const distributed::State& state) {
  const distributed::Counts counts = state.counts();
  const Partition& partition = state.model().partitions().front();
  if (arguments.json) {
    Json json;
    json["rows"] = counts.rows;
    json["passes"] = counts.passes;
    json["leaves"] = partition.num_leaves();
    json["top_leaves"] = counts.top_leaves;
    json["held_out_rmse"] = finite_or_null(counts.held_out_rmse);
    json["output"] = arguments.output;
    print_json(json);
    return;
  }
  print(fmt::format("{} rows, {} passes over them\n", counts.rows, counts.passes));
  print(fmt::format("{} leaves in {} {}; held-out RMSE {:.5g}\n", partition.num_leaves(), counts.top_leaves,
                    counts.top_leaves == 1 ? "branch" : "branches, each fitted in memory", counts.held_out_rmse));
  print(arguments.output.empty() ? "Not written: give -o FILE.json\n"
                                 : fmt::format("Model written to {}\n", arguments.output));
}

}  // namespace

double read_memory(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  constexpr std::string_view units = "KMGT";
  const std::size_t at = unit.size() == 1 ? units.find(unit.front()) : std::string_view::npos;
  if (error != std::errc() || at == std::string_view::npos || !(value > 0.0)) {
    throw std::invalid_argument(fmt::format("--memory is \"{}\", it must be a number with K, M, G or T: 4G", text));
  }
  return value * std::pow(1024.0, static_cast<double>(at) + 1.0);
}

void add_arrow_fit_options(CLI::App& command, ArrowFitArguments& arguments) {
  command
      .add_option("--memory", arguments.memory,
                  "Of an Arrow file: memory that the fit may take, such as 4G [half of the machine's]")
      ->type_name("BYTES");
  add_output_file(command, "--checkpoint", arguments.checkpoint,
                  "Of an Arrow file: where the fit stands after every pass over the rows");
  command.add_flag("--resume", arguments.resume, "Go on from the file of --checkpoint if there is one");
}

void arrow_fit_command(const CLI::App& command, const ArrowFitArguments& arguments, Processes& processes) {
  refuse_options_of_csv(command);
  if (arguments.resume && arguments.checkpoint.empty()) {
    throw std::invalid_argument("--resume goes on from the file of --checkpoint, which is not given");
  }
  const LearningArguments& learning = arguments.learning;
  const ArrowTable table = ArrowTable::open(learning.data);
  if (table.rows() == 0) throw std::runtime_error(fmt::format("{}: there are columns and no rows", table.path()));
  std::string header;
  for (const std::string& column : table.columns()) header += (header.empty() ? "" : ",") + csv_field(column);
  if (learning.targets.size() != 1) {
    throw std::invalid_argument(
        fmt::format("--target: an Arrow file is fitted for one target at a time; the columns of "
                    "{} are {}",
                    table.path(), csv_row(table.columns())));
  }
  std::vector<std::string> columns = choose_inputs(Csv::parse(header + "\n", table.path()), learning);
  distributed::Options options{.fit = learning.options};
  options.fit.intervals = !arguments.no_intervals;
  const double row_bytes = 8.0 * static_cast<double>(columns.size() + 1);
  options.branch_rows = std::max<Eigen::Index>(
      100, static_cast<Eigen::Index>(part_for_branches * memory_of(arguments) / (bytes_per_byte * row_bytes)));
  const bool is_first = processes.rank() == 0;
  distributed::State state = distributed::State::from_bytes(
      processes.of_first(is_first ? first_state(arguments, columns, options).to_bytes() : std::string()));
  columns.push_back(learning.targets.front());
  const RowRange range = rows_of(processes, table.rows(), options.block_rows);
  const int threads = learning.options.max_threads;
  while (!state.finished()) {
    ProgressBar bar(
        fmt::format("pass {} ({})", state.counts().passes + 1, name_of_step[static_cast<std::size_t>(state.step())]));
    distributed::Sums all = processes.merged(sum_rows(table, range, columns, state, options.block_rows, threads, bar));
    std::string next;
    if (is_first) {
      next = distributed::advance(state, std::move(all), {}, threads).to_bytes();
      if (!arguments.checkpoint.empty()) write_file(arguments.checkpoint, next);
    }
    state = distributed::State::from_bytes(processes.of_first(std::move(next)));
  }
  if (!is_first) return;
  if (!arguments.output.empty()) write_file(arguments.output, state.model_json());
  print_result(arguments, state);
  if (!arguments.json) print(processes.cost());
}

}  // namespace llmt::apps
