#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "llmt/csv.hpp"
#include "report/stream/stream_summary.hpp"
#include "shared/cli.hpp"
#include "shared/standard_error.hpp"
#include "shared/table_file.hpp"
#include "trees/stream_command.hpp"

namespace llmt::apps {
namespace {

// What was learned, and from what.
struct Learned {
  std::string name;
  std::vector<std::string> inputs;
  std::unique_ptr<Stream> stream;
  std::vector<report::LargestMagnitude> largest_inputs;
  std::vector<report::LargestMagnitude> largest_targets;
};

constexpr std::size_t piece_bytes = 1 << 20;

// Rows so far and the running errors, on one line that is rewritten, where stderr is a terminal.
void show_progress(const Stream& stream) {
  if (::isatty(STDERR_FILENO) != 0) {
    write_stderr(fmt::format("\r\033[K{} rows, RMSE before learning {:.5g}, of the last 1000 {:.5g}",
                             stream.counts().rows, fmt::join(stream.prequential_rmse(), ", "),
                             fmt::join(stream.recent_rmse(), ", ")));
  }
}

void clear_progress() {
  if (::isatty(STDERR_FILENO) != 0) {
    write_stderr("\r\033[K");
  }
}

void look_at(const Csv& piece, const Eigen::MatrixXd& values, std::vector<report::LargestMagnitude>& largest) {
  largest.resize(values.cols());
  for (std::size_t j = 0; j < largest.size(); ++j) {
    largest[j].add(piece, values.col(j));
  }
}

void refuse_small(const std::string& file, const std::vector<std::string>& columns,
                  const std::vector<report::LargestMagnitude>& largest) {
  for (std::size_t j = 0; j < largest.size(); ++j) {
    largest[j].refuse_small(file, columns[j]);
  }
}

void add(const Csv& piece, const StreamArguments& arguments, Learned& learned) {
  const LearningArguments& learning = arguments.learning;
  const Eigen::MatrixXd targets = piece.numbers(learning.targets, 1);
  const Eigen::VectorXd weights = learning.weight.empty() ? Eigen::VectorXd() : piece.numbers(learning.weight, 1);
  report::refuse_negative_weight(piece, learning.weight, weights);
  Eigen::MatrixXd inputs;
  try {
    inputs = piece.numbers_or_missing(learned.inputs, 1);
  } catch (const DecimalMarkError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(std::string(error.what()) +
                             " (--stream takes no categories; --ignore COLUMN leaves a column out)");
  }
  report::refuse_large(piece, learned.inputs, inputs, std::vector<double>(learned.inputs.size(), largest_magnitude));
  report::refuse_large(piece, learning.targets, targets,
                       std::vector<double>(learning.targets.size(), largest_magnitude));
  if (weights.size() > 0) report::refuse_large(piece, {&learning.weight, 1}, weights, {&largest_magnitude, 1});
  learned.stream->add(inputs, targets, weights);
  look_at(piece, inputs, learned.largest_inputs);
  look_at(piece, targets, learned.largest_targets);
}

Learned learn(const StreamArguments& arguments) {
  const LearningArguments& learning = arguments.learning;
  const StreamOptions options = stream_options(learning.options);
  const bool standard_input = learning.data == "-";
  Learned learned{table_name(learning.data), {}, nullptr, {}, {}};
  std::ifstream file;
  if (!standard_input) {
    file.open(learning.data, std::ios::binary);
    if (!file) {
      throw std::runtime_error(fmt::format("{}: cannot be read: {}", learned.name, std::strerror(errno)));
    }
  } else {
    std::ios::sync_with_stdio(false);
  }
  CsvPieces pieces(standard_input ? std::cin : file, learned.name, piece_bytes, learning.mark);
  while (std::optional<Csv> piece = pieces.next()) {
    if (learning.thousands) piece->read_thousands();
    if (!learned.stream) {
      learned.inputs = choose_inputs(*piece, learning);
      learned.stream = std::make_unique<Stream>(std::ssize(learned.inputs), std::ssize(learning.targets), options);
    }
    add(*piece, arguments, learned);
    show_progress(*learned.stream);
  }
  clear_progress();
  if (!learned.stream || learned.stream->counts().rows == 0) {
    throw std::runtime_error(
        fmt::format("{}: there is a header and no rows{}", learned.name, learned.stream ? " of positive weight" : ""));
  }
  refuse_small(learned.name, learned.inputs, learned.largest_inputs);
  refuse_small(learned.name, learning.targets, learned.largest_targets);
  return learned;
}

Model snapshot(const Learned& learned, ValidityChoice validity) {
  try {
    return learned.stream->snapshot(validity);
  } catch (const std::invalid_argument&) {  // all else has been checked
    throw std::runtime_error(fmt::format(
        "{}: with these weights and magnitudes the sums of squares overflow or vanish; other units are needed",
        learned.name));
  }
}

}  // namespace

void stream_command(const CLI::App& command, const StreamArguments& arguments) {
  refuse_options(command, streaming);
  const Learned learned = learn(arguments);
  const Model model =
      snapshot(learned, arguments.learning.options.validity).named(learned.inputs, arguments.learning.targets);
  if (!arguments.output.empty()) {
    save(model, arguments.output);
  }
  const report::StreamRun run{learned.name,    learned.inputs, arguments.learning.targets,
                              *learned.stream, model,          arguments.output};
  if (arguments.json) {
    print_json(report::stream_json(run));
    return;
  }
  print(report::stream_text(run, output_width()));
  if (learned.stream->counts().max_leaves == 1 && arguments.learning.options.max_leaves == 0) {
    print(fmt::format(
        "{} inputs: the sums of a leaf would take more than 1 GiB, so nothing was split. --max-leaves 16 splits.\n",
        learned.inputs.size()));
  }
  if (!arguments.output.empty()) print(fmt::format("Model written to {}\n", arguments.output));
}

}  // namespace llmt::apps
