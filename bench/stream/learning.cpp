// What a stream learns of the synthetic function without a change: error to the truth, time and memory after one pass,
// its spread over streams, and false alarms.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "llmt/fit.hpp"
#include "resources.hpp"
#include "stream/stream.hpp"

namespace bench {
namespace {

constexpr double mebibyte = 1048576.0;

void report(Eigen::Index rows, const Sample& test) {
  llmt::Stream stream(stream_inputs, 1);
  const double seconds = feed(stream, rows, 1);
  const llmt::StreamCounts counts = stream.counts();
  double chosen = 0.0;
  Eigen::Index leaves = 0;
  const Cost snapshot = measure([&] {
    const llmt::Model model = stream.snapshot();
    leaves = model.partitions().front().num_leaves();
    chosen = error(model.predict(test.x), test);
  });
  const double crisp = error(stream.snapshot(llmt::ValidityChoice::crisp).predict(test.x), test);
  fmt::print("{:>9} {:10.4f} {:10.4f} {:12.4f} {:7} {:7} {:7} {:7} {:7} {:9.0f} {:9.2f} {:10.1f} {:10.1f}\n", rows,
             chosen, crisp, stream.prequential_rmse()(0), leaves, counts.leaves, counts.splits, counts.prunes,
             counts.drifts, 1e9 * seconds / static_cast<double>(rows), snapshot.cpu,
             static_cast<double>(counts.bytes) / mebibyte, peak_memory() / mebibyte);
  std::fflush(stdout);
}

void scaling(const std::vector<Eigen::Index>& sizes, Eigen::Index batch_rows) {
  const Sample test = sample(100000, stream_inputs, 999);
  fmt::print("{:>9} {:>10} {:>10} {:>12} {:>7} {:>7} {:>7} {:>7} {:>7} {:>9} {:>9} {:>10} {:>10}\n", "rows", "snapshot",
             "crisp", "prequential", "leaves", "grown", "splits", "prunes", "drifts", "ns/row", "snap. s", "own MiB",
             "peak MiB");
  for (const Eigen::Index rows : sizes) report(rows, test);
  if (batch_rows == 0) return;
  const Sample train = sample(batch_rows, stream_inputs, 1);
  double rmse = 0.0;
  const Cost cost = measure([&] { rmse = error(llmt::fit(train.x, train.y).model.predict(test.x), test); });
  fmt::print("fit() on {} rows: {:.4f}, {:.1f} CPU s\n", batch_rows, rmse, cost.cpu);
}

void spread(Eigen::Index rows, int seeds) {
  const Sample test = sample(20000, stream_inputs, 999);
  Eigen::VectorXd errors(seeds);
  for (int seed = 1; seed <= seeds; ++seed) {
    llmt::Stream stream(stream_inputs, 1);
    feed(stream, rows, seed);
    errors(seed - 1) = error(stream.predict(test.x), test);
  }
  fmt::print("{} rows, {} streams: error to the truth {:.4f} +- {:.4f}, {:.4f} ... {:.4f}\n", rows, seeds,
             errors.mean(), std::sqrt((errors.array() - errors.mean()).square().mean()), errors.minCoeff(),
             errors.maxCoeff());
}

void alarms(int seeds, Eigen::Index rows) {
  Eigen::Index drifts = 0, streams = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    llmt::Stream stream(stream_inputs, 1);
    feed(stream, rows, 100 + seed);
    drifts += stream.counts().drifts;
    streams += stream.counts().drifts > 0 ? 1 : 0;
  }
  fmt::print("{} alarms in {} of {} streams of {} rows without a change\n", drifts, streams, seeds, rows);
}

struct Repeated {
  Eigen::Index rows = 100000;
  int seeds = 10;
};

std::shared_ptr<Repeated> repeated_options(CLI::App& command, int seeds) {
  const auto arguments = std::make_shared<Repeated>(Repeated{.seeds = seeds});
  command.add_option("--rows", arguments->rows, "rows of a stream")->capture_default_str();
  command.add_option("--seeds", arguments->seeds, "number of streams")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  return arguments;
}

}  // namespace

double feed(llmt::Stream& stream, Eigen::Index rows, std::uint64_t seed) {
  constexpr Eigen::Index block = 10000;
  double seconds = 0.0;
  for (Eigen::Index done = 0; done < rows; done += block) {
    const auto number = static_cast<std::uint64_t>(done / block);
    const Sample fresh = sample(std::min(block, rows - done), stream_inputs, seed + 1000003 * number);
    seconds += measure([&] { stream.add(fresh.x, fresh.y); }).cpu;
  }
  return seconds;
}

void add_alarms(CLI::App& program) {
  CLI::App* command = program.add_subcommand("alarms", "Alarms where nothing changes");
  command->callback([arguments = repeated_options(*command, 20)] { alarms(arguments->seeds, arguments->rows); });
}

void add_spread(CLI::App& program) {
  CLI::App* command = program.add_subcommand("spread", "Mean and spread of the live tree's error over streams");
  command->callback([arguments = repeated_options(*command, 10)] { spread(arguments->rows, arguments->seeds); });
}

void add_scaling(CLI::App& program) {
  struct Arguments {
    std::vector<Eigen::Index> sizes = {100000, 1000000};
    Eigen::Index batch_rows = 0;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("scaling", "Error, time and memory after one pass");
  command->add_option("rows", arguments->sizes, "rows of each stream")->capture_default_str();
  command->add_option("--batch", arguments->batch_rows, "beside it llmt::fit of this number of rows; 0: none")
      ->capture_default_str();
  command->callback([arguments] { scaling(arguments->sizes, arguments->batch_rows); });
}

}  // namespace bench
