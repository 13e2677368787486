// How fast a stream follows a change of the function: the number of rows after the change until its error to the new
// truth is within 5 % of what a fresh stream has after N rows, as a multiple of N.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

#include "stream/stream.hpp"

namespace bench {
namespace {

constexpr std::array<Eigen::Index, 4> levels = {1000, 5000, 20000, 100000};  // N
constexpr Eigen::Index horizon = 2 * levels.back();                          // rows after the change

enum class Change { permuted, negated, half, shifted };

constexpr std::pair<Change, const char*> changes[] = {
    {Change::permuted, "permuted"}, {Change::negated, "negated"}, {Change::half, "half"}, {Change::shifted, "shifted"}};

double changed_truth(const Eigen::VectorXd& x, Change change) {
  switch (change) {
    case Change::permuted:
      return truth(x.reverse());
    case Change::negated:
      return -truth(x);
    case Change::half:
      return x(0) < 0.4 ? truth(x) : 4.0 - truth(x);
    case Change::shifted:
      return truth(x) + 5.0;
  }
  return 0.0;
}

Sample changed_sample(Eigen::Index rows, std::uint64_t seed, Change change) {
  Sample result = sample(rows, stream_inputs, seed);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double truth = changed_truth(result.x.row(i).transpose(), change);
    result.y(i) += truth - result.truth(i);
    result.truth(i) = truth;
  }
  return result;
}

// Numbers of rows after the change at which errors are taken: every 500, later 10 % apart, and every level.
std::vector<Eigen::Index> checkpoints() {
  std::vector<Eigen::Index> rows;
  Eigen::Index done = 0;
  for (Eigen::Index next = 500; done < horizon; next = std::max(next + 500, next * 11 / 10)) {
    for (const Eigen::Index level : levels) next = done < level && next > level ? level : next;
    next = std::min(next, horizon);
    rows.push_back(done = next);
  }
  return rows;
}

// Errors to the changed truth at the checkpoints.
struct Curves {
  Eigen::VectorXd stream;  // that has learned the function before the change
  Eigen::VectorXd fresh;   // that begins with the change
  llmt::StreamCounts before, after;
};

Curves follow(Change change, Eigen::Index at, int seed, const std::vector<Eigen::Index>& rows, const Sample& test) {
  llmt::Stream stream(stream_inputs, 1), fresh(stream_inputs, 1);
  feed(stream, at, seed);
  Curves curves{Eigen::VectorXd(std::ssize(rows)), Eigen::VectorXd(std::ssize(rows)), stream.counts(), {}};
  Eigen::Index done = 0;
  for (Eigen::Index k = 0; k < std::ssize(rows); ++k) {
    const Sample next = changed_sample(rows[k] - done, 7777 * seed + rows[k], change);
    stream.add(next.x, next.y);
    fresh.add(next.x, next.y);
    done = rows[k];
    curves.stream(k) = error(stream.predict(test.x), test);
    curves.fresh(k) = error(fresh.predict(test.x), test);
  }
  curves.after = stream.counts();
  return curves;
}

void print_levels(const Eigen::VectorXd& stream, const Eigen::VectorXd& fresh, const std::vector<Eigen::Index>& rows) {
  for (const Eigen::Index level : levels) {
    const Eigen::Index k = std::ranges::find(rows, level) - rows.begin();
    const auto reached =
        std::find_if(stream.begin(), stream.end(), [&](double error) { return error <= 1.05 * fresh(k); });
    const auto in_levels = [&](Eigen::Index count) { return static_cast<double>(count) / static_cast<double>(level); };
    fmt::print(" {:8.4f} {:8.4f} {:>6} |", fresh(k), stream(k),
               reached == stream.end() ? fmt::format(">{:.0f}", in_levels(horizon))
                                       : fmt::format("{:.2f}", in_levels(rows[reached - stream.begin()])));
  }
  fmt::print("\n");
  std::fflush(stdout);
}

void drift(int seeds) {
  const std::vector<Eigen::Index> rows = checkpoints();
  fmt::print("{:9} {:>8} {:>5} {:>7} {:>8} |", "change", "at row", "seed", "alarms", "replaced");
  for (const Eigen::Index level : levels) {
    fmt::print(" {:>8} {:>8} {:>6} |", fmt::format("N={}", level), "stream", "rows/N");
  }
  fmt::print("   (errors: fresh after N rows, stream after N rows; rows until within 5 % / N)\n");
  for (const auto& [change, name] : changes) {
    const Sample test = changed_sample(10000, 999, change);
    for (const Eigen::Index at : {20000, 200000}) {
      Eigen::VectorXd mean_stream = Eigen::VectorXd::Zero(std::ssize(rows));
      Eigen::VectorXd mean_fresh = mean_stream;
      for (int seed = 1; seed <= seeds; ++seed) {
        const Curves curves = follow(change, at, seed, rows, test);
        mean_stream += curves.stream / seeds;
        mean_fresh += curves.fresh / seeds;
        fmt::print("{:9} {:>8} {:>5} {:>7} {:>8} |", name, at, seed, curves.after.drifts - curves.before.drifts,
                   curves.after.replacements);
        print_levels(curves.stream, curves.fresh, rows);
      }
      fmt::print("{:9} {:>8} {:>5} {:>16} |", name, at, "mean", "");
      print_levels(mean_stream, mean_fresh, rows);
    }
  }
}

}  // namespace

void add_drift(CLI::App& program) {
  const auto seeds = std::make_shared<int>(3);
  CLI::App* command = program.add_subcommand("drift", "Recovery after the function has changed");
  command->add_option("--seeds", *seeds, "number of streams for each change")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([seeds] { drift(*seeds); });
}

}  // namespace bench
