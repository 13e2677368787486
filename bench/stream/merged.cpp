// What merging costs: streams of shards, merged pair by pair, beside one stream of all rows.
#include <fmt/format.h>

#include <iterator>
#include <memory>
#include <utility>
#include <vector>

#include "resources.hpp"
#include "stream/stream.hpp"

namespace bench {
namespace {

void print_shards(Eigen::Index rows, Eigen::Index shards, const llmt::StreamOptions& options, const Sample& test) {
  std::vector<llmt::Stream> streams;
  double alone = 0.0;
  for (Eigen::Index k = 0; k < shards; ++k) {
    llmt::Stream& stream = streams.emplace_back(stream_inputs, 1, options);
    feed(stream, rows / shards, 1 + static_cast<std::uint64_t>(k * (rows / shards) / 10000) * 1000003);
    alone += error(stream.snapshot().predict(test.x), test) / static_cast<double>(shards);
  }
  const double seconds = measure([&] {
                           while (streams.size() > 1) {
                             std::vector<llmt::Stream> pairs;
                             for (std::size_t k = 0; k + 1 < streams.size(); k += 2) {
                               pairs.push_back(merge(std::move(streams[k]), std::move(streams[k + 1])));
                             }
                             if (streams.size() % 2 == 1) pairs.push_back(std::move(streams.back()));
                             streams = std::move(pairs);
                           }
                         }).cpu;
  const llmt::Stream& merged = streams.front();
  fmt::print("{:>9} {:7} {:10.4f} {:10.4f} {:10.4f} {:7} {:8.2f}\n", rows, shards, alone,
             error(merged.snapshot().predict(test.x), test),
             error(merged.snapshot(llmt::ValidityChoice::crisp).predict(test.x), test), merged.counts().leaves,
             seconds);
  std::fflush(stdout);
}

}  // namespace

void add_merged(CLI::App& program) {
  struct Arguments {
    std::vector<Eigen::Index> rows = {100000};
    std::vector<Eigen::Index> shards = {1, 2, 4, 8};
    llmt::StreamOptions options;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("merged", "Error of merged streams beside that of one");
  command->add_option("rows", arguments->rows, "rows of all shards, whole blocks of 10000")->capture_default_str();
  command->add_option("--shards", arguments->shards, "numbers of shards")->capture_default_str();
  command->add_option("--reservoir", arguments->options.reservoir_rows, "rows kept")->capture_default_str();
  command->callback([arguments] {
    const Sample test = sample(100000, stream_inputs, 999);
    fmt::print("{:>9} {:>7} {:>10} {:>10} {:>10} {:>7} {:>8}\n", "rows", "shards", "a shard", "merged", "crisp",
               "leaves", "merge s");
    for (const Eigen::Index rows : arguments->rows) {
      for (const Eigen::Index shards : arguments->shards) print_shards(rows, shards, arguments->options, test);
    }
  });
}

}  // namespace bench
