#include "trees/arrow_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "llmt/csv.hpp"
#include "llmt/distributed.hpp"
#include "llmt/files.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/table_files.hpp"
#include "trees/accidental.hpp"
#include "trees/arrow_learning.hpp"

namespace llmt::apps {
namespace {

// Rows are read, and their sums formed, so many blocks at a time.
constexpr Eigen::Index blocks_at_once = 4;

// fit() takes at most about this many times the bytes of a branch's rows, the rows included: 4.5 were measured with ten
// inputs and crisp leaves.
constexpr double bytes_per_byte = 5.0;
// The part of the memory that branches may take; the rest is for sums and the tree.
constexpr double part_for_branches = 0.75;
// A sample takes this part of a branch's rows at most: a pass holds several before they are merged.
constexpr Eigen::Index part_for_sample = 4;

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
  return 0.5 * physical_memory();
}

// The most rows that a branch may have.
Eigen::Index branch_rows_of(const ArrowFitArguments& arguments, std::size_t columns) {
  constexpr double fewest = 100.0;
  constexpr double most = 1e12;
  const double row_bytes = 8.0 * static_cast<double>(columns);
  const double rows = part_for_branches * memory_of(arguments) / (bytes_per_byte * row_bytes);
  if (rows < fewest) {
    throw std::invalid_argument(
        fmt::format("--memory is \"{}\", {} columns need at least {:.0f}K", arguments.memory, columns,
                    std::ceil(fewest * bytes_per_byte * row_bytes / part_for_branches / 1024.0)));
  }
  return static_cast<Eigen::Index>(std::min(rows, most));
}

// The columns that a pass reads: inputs, target, and the weight if there is one.
struct PassColumns {
  std::vector<std::string> names;
  Eigen::Index inputs = 0;
  std::vector<std::vector<std::string>> levels;  // of the inputs

  bool has_weight() const { return std::ssize(names) == inputs + 2; }
};

// What a state from a file makes of a table may go wrong in ways that only a pass shows: then the file is at fault. No
// file: the state was made here.
template <class Step>
auto with_state_of(const std::string& file, const Step& step) {
  try {
    return step();
  } catch (const std::bad_alloc&) {
    if (file.empty()) throw;
    throw std::runtime_error(fmt::format("{}: going on from it needs more memory than there is", file));
  } catch (const std::exception& error) {
    if (file.empty()) throw;
    throw std::runtime_error(fmt::format("{}: {}", file, error.what()));
  }
}

// One pass over the rows first ... last - 1, which begin with a block.
distributed::Sums sum_rows(const TableFiles& table, RowRange range, const PassColumns& columns,
                           const distributed::State& state, const std::string& state_file, Eigen::Index block_rows,
                           int threads, ProgressBar& bar) {
  distributed::Sums all;
  for (Eigen::Index first = range.first; first < range.last; first += blocks_at_once * block_rows) {
    const Eigen::Index count = std::min(blocks_at_once * block_rows, range.last - first);
    const Eigen::MatrixXd rows = table.read(first, count, columns.names, columns.levels);
    check_rows(table, columns.names, columns.inputs, rows, first);
    distributed::Rows shard{rows.leftCols(columns.inputs), rows.col(columns.inputs), first / block_rows};
    if (columns.has_weight()) shard.weights = rows.col(columns.inputs + 1);
    all = with_state_of(state_file, [&] { return merge(std::move(all), distributed::sums(shard, state, threads)); });
    bar.show(first + count - range.first, range.last - range.first);
  }
  return all;
}

distributed::State first_state(const ArrowFitArguments& arguments, const std::string& state_file,
                               const std::vector<std::string>& inputs, const distributed::Options& options) {
  const std::string& target = arguments.learning.targets.front();
  distributed::State state = distributed::start(inputs, target, options);
  if (state_file.empty()) return state;
  distributed::State saved =
      distributed::State::from_bytes(read_file(state_file, {.bytes = std::uintmax_t{1} << 33}), state_file);
  if (!saved.continues(state)) {
    throw std::runtime_error(
        fmt::format("{}: is of a fit of other columns or with other options, or another --memory", state_file));
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
    json["is_of_sample"] = counts.is_of_sample;
    json["held_out_rmse"] = finite_or_null(counts.held_out_rmse);
    json["output"] = arguments.output;
    print_json(json);
    return;
  }
  const auto plural = [](Eigen::Index count, const char* one, const char* many) {
    return fmt::format("{} {}", count, count == 1 ? one : many);
  };
  print(fmt::format("{}, {} passes over them\n", plural(counts.rows, "row", "rows"), counts.passes));
  print(fmt::format("{} in {}; {}\n", plural(partition.num_leaves(), "leaf", "leaves"),
                    counts.is_of_sample ? "a tree of a sample, fitted to all rows"
                                        : plural(counts.top_leaves, "branch", "branches, each fitted in memory"),
                    std::isfinite(counts.held_out_rmse) ? fmt::format("held-out RMSE {:.5g}", counts.held_out_rmse)
                                                        : "no held-out rows"));
  print(arguments.output.empty() ? "Not written: give -o FILE.json\n"
                                 : fmt::format("Model written to {}\n", arguments.output));
}

}  // namespace

std::vector<std::string> ArrowFitArguments::files() const {
  std::vector<std::string> all = {learning.data};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

double read_memory(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  constexpr std::string_view units = "KMGT";
  const std::size_t at = unit.size() == 1 ? units.find(unit.front()) : std::string_view::npos;
  if (error != std::errc() || at == std::string_view::npos || !(value > 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(fmt::format("--memory is \"{}\", it must be a number with K, M, G or T: 4G", text));
  }
  return value * std::pow(1024.0, static_cast<double>(at) + 1.0);
}

void add_arrow_fit_options(CLI::App& command, ArrowFitArguments& arguments) {
  add_input_files(command, "more", arguments.more, "Further files of the same table, Arrow or CSV");
  command
      .add_option("--memory", arguments.memory,
                  "Of Arrow or several files: memory that the fit may take, such as 4G [half of the machine's]")
      ->type_name("BYTES");
  add_output_file(command, "--checkpoint", arguments.checkpoint,
                  "Of Arrow or several files: where the fit stands after every pass over the rows");
  command.add_flag("--resume", arguments.resume, "Go on from the file of --checkpoint if there is one");
}

void arrow_fit_command(const CLI::App& command, const ArrowFitArguments& arguments, Processes& processes) {
  refuse_options(command, of_files);
  if (arguments.resume && arguments.checkpoint.empty()) {
    throw std::invalid_argument("--resume goes on from the file of --checkpoint, which is not given");
  }
  const LearningArguments& learning = arguments.learning;
  const TableFiles table(arguments.files(), {learning.mark, learning.thousands});
  if (table.rows() == 0) throw std::runtime_error(fmt::format("{}: there are columns and no rows", table.name()));
  if (learning.targets.size() != 1) {
    throw std::invalid_argument(fmt::format("--target: one target is fitted at a time; the columns of {} are {}",
                                            table.name(), csv_row(table.columns())));
  }
  PassColumns columns;
  const bool is_first = processes.rank() == 0;
  columns.names = choose_inputs(table.columns(), table.name(), learning);
  constexpr std::size_t most_words = 255;  // distributed::Options::levels
  if (is_first) columns.names = without_accidental_words(learning, std::move(columns.names), table, most_words);
  columns.names = Json::parse(processes.of_first(Json(columns.names).dump())).get<std::vector<std::string>>();
  columns.inputs = std::ssize(columns.names);
  columns.names.push_back(learning.targets.front());
  distributed::Options options{
      .weighted = !learning.weight.empty(), .fit = learning.options, .may_have_codes = learning.may_have_codes};
  if (options.weighted) columns.names.push_back(learning.weight);
  const std::vector<std::string> inputs(columns.names.begin(), columns.names.begin() + columns.inputs);
  table.require_numbers({columns.names.begin() + columns.inputs, columns.names.end()});
  options.branch_rows = branch_rows_of(arguments, columns.names.size());
  options.sample_rows =
      std::min(options.sample_rows, std::max<Eigen::Index>(options.branch_rows / part_for_sample, 100));
  if (is_first) {
    options.levels = table.levels(inputs, most_words);
    set_columns(learning.columns, inputs, options.levels, options.fit);
  }
  const bool goes_on = arguments.resume && std::filesystem::exists(arguments.checkpoint);
  const std::string state_file = goes_on ? arguments.checkpoint : std::string();
  distributed::State state = distributed::State::from_bytes(
      processes.of_first(is_first ? first_state(arguments, state_file, inputs, options).to_bytes() : std::string()));
  columns.levels = state.levels();
  const RowRange range = rows_of(processes, table.rows(), options.block_rows);
  const int threads = learning.options.max_threads;
  while (!state.finished()) {
    ProgressBar bar(fmt::format("pass {} ({})", state.counts().passes + 1, name_of(state.step())));
    distributed::Sums all =
        processes.merged(sum_rows(table, range, columns, state, state_file, options.block_rows, threads, bar));
    std::string next;
    if (is_first) {
      next = with_state_of(state_file, [&] {
               return distributed::advance(state, std::move(all), {}, threads);
             }).to_bytes();
      if (!arguments.checkpoint.empty()) write_file(arguments.checkpoint, next);
    }
    state =
        with_state_of(state_file, [&] { return distributed::State::from_bytes(processes.of_first(std::move(next))); });
  }
  if (!is_first) return;
  if (!arguments.output.empty()) write_file(arguments.output, state.model_json());
  print_result(arguments, state);
  if (!arguments.json) print(processes.cost());
}

}  // namespace llmt::apps
