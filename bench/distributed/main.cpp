// Trees by sums over blocks beside fit() in memory: seconds and errors (docs/algorithms/distributed.md).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "llmt/distributed.hpp"
#include "llmt/fit.hpp"

namespace {

using Clock = std::chrono::steady_clock;

struct Table {
  Eigen::MatrixXd inputs;
  Eigen::VectorXd truth;
  Eigen::VectorXd output;
};

// Friedman's function (1991) of ten uniform inputs, and noise of standard deviation 1.
Table friedman(Eigen::Index rows, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> uniform;
  Table table{Eigen::MatrixXd(rows, 10), Eigen::VectorXd(rows), Eigen::VectorXd(rows)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < 10; ++j) table.inputs(i, j) = uniform(random);
    const auto x = table.inputs.row(i);
    table.truth(i) =
        10.0 * std::sin(std::numbers::pi * x(0) * x(1)) + 20.0 * std::pow(x(2) - 0.5, 2) + 10.0 * x(3) + 5.0 * x(4);
    table.output(i) = table.truth(i) + noise(random);
  }
  return table;
}

void print_row(const char* way, Clock::time_point begin, const llmt::Model& model, const Table& asked) {
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  const Eigen::MatrixXd predicted = model.predict(asked.inputs);
  fmt::print("{:8} {:8.1f} s {:5} leaves  RMSE {:.4f}  to the function {:.4f}\n", way, seconds,
             model.partitions()[0].num_leaves(), llmt::rmse(predicted, asked.output)(0),
             llmt::rmse(predicted, asked.truth)(0));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Trees by sums over blocks beside fit() in memory"};
  Eigen::Index rows = 100000;
  Eigen::Index parts = 8;
  Eigen::Index sample = 131072;
  int threads = 0;
  bool only_sums = false;
  app.add_option("--rows", rows, "Rows to learn from")->check(CLI::Range(1000, 1 << 30));
  app.add_option("--parts", parts, "Rows divided by the largest branch")->check(CLI::Range(1, 1000));
  app.add_option("--sample", sample, "Rows of the sample")->check(CLI::Range(100, 1 << 30));
  app.add_option("--threads", threads, "0: all")->check(CLI::Range(0, 1024));
  app.add_flag("--only-sums", only_sums, "Leave fit() out");
  CLI11_PARSE(app, argc, argv);
  const Table table = friedman(rows, 1);
  const Table asked = friedman(50000, 2);
  llmt::FitOptions options;
  options.intervals = false;
  options.max_threads = threads;
  Clock::time_point begin = Clock::now();
  if (!only_sums) print_row("fit()", begin, llmt::fit(table.inputs, table.output, options).model, asked);
  std::vector<std::string> names;
  for (int j = 1; j <= 10; ++j) names.push_back(fmt::format("x{}", j));
  begin = Clock::now();
  const llmt::distributed::Options by_sums{.branch_rows = rows / parts, .sample_rows = sample, .fit = options};
  llmt::distributed::State state = llmt::distributed::start(names, "y", by_sums);
  while (!state.finished()) {
    llmt::distributed::Sums all = llmt::distributed::sums({table.inputs, table.output, 0}, state, threads);
    state = llmt::distributed::advance(state, std::move(all), {}, threads);
  }
  print_row("sums", begin, state.model(), asked);
}
