// How time and memory of a whole fit with default options grow with rows, inputs and threads: the function of
// synthetic.hpp, training rows 1e3, 1e4, ..., inputs 2, 5, 10, 20, 32, threads 1 and 2. Every fit is a process of its
// own, so that its peak memory is its own; a fit that needs more CPU time than allowed is stopped, and larger ones of
// its kind are left out. Error: RMSE of the noise-free truth on 100000 fresh rows (noise of the data: 1). Memory: what
// the fit holds beyond the data at its peak, in MiB and as a multiple of the data (rows x (inputs + 1) doubles).
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "llmt/fit.hpp"
#include "resources.hpp"
#include "scaling/scaling.hpp"
#include "synthetic.hpp"

namespace bench {
namespace {

struct Run {
  Eigen::Index rows = 0;
  Eigen::Index inputs = 0;
  int threads = 0;
  Cost fit = {};
  double predict = 0.0;  // CPU seconds per million rows
  double rmse = 0.0;
  double leaves = 0.0;
};

void fill(Run& run) {
  const Sample train = sample(run.rows, run.inputs, 1);
  std::optional<llmt::FitResult> result;
  run.fit = measure([&] { result.emplace(llmt::fit(train.x, train.y, {.max_threads = run.threads})); });
  run.leaves = static_cast<double>(result->summary.partitions[0].leaves);
  const Sample test = sample(100000, run.inputs, 2);
  Eigen::MatrixXd predicted;
  run.predict = 10.0 * measure([&] { predicted = result->model.predict(test.x, run.threads); }).cpu;
  run.rmse = llmt::rmse(predicted, test.truth)(0);
}

// The run in a process of its own; nothing if that did not end well.
std::optional<Run> measure_apart(Run run, rlim_t seconds) {
  int pipe_ends[2];
  if (pipe(pipe_ends) != 0) return {};
  const pid_t child = fork();
  if (child == 0) {
    const rlimit limit{seconds, seconds};
    setrlimit(RLIMIT_CPU, &limit);
    try {
      fill(run);
    } catch (const std::exception& error) {
      fmt::print(stderr, "scaling: {}\n", error.what());
      _exit(1);
    }
    _exit(write(pipe_ends[1], &run, sizeof run) == sizeof run ? 0 : 1);
  }
  close(pipe_ends[1]);
  const bool complete = child > 0 && read(pipe_ends[0], &run, sizeof run) == sizeof run;
  close(pipe_ends[0]);
  if (child > 0) waitpid(child, nullptr, 0);
  return complete ? std::optional(run) : std::nullopt;
}

void print(const Run& run) {
  const double data = static_cast<double>(run.rows * (run.inputs + 1)) * sizeof(double);
  fmt::print("{:9} {:7} {:8} {:10.3f} {:10.3f} {:10.2f} {:8.4f} {:7.0f} {:10.1f} {:8.1f}\n", run.rows, run.inputs,
             run.threads, run.fit.wall, run.fit.cpu, run.predict, run.rmse, run.leaves, run.fit.memory / 0x1p20,
             run.fit.memory / data);
  std::fflush(stdout);
}

// Least-squares slope of log(time) against log(size), with the slopes from each size to the next.
template <class Size>
void print_exponent(const char* name, const std::vector<Run>& runs, const Size& size) {
  if (runs.size() < 2) return;
  double mean_x = 0.0, mean_y = 0.0;
  for (const Run& run : runs) {
    mean_x += std::log(size(run)) / static_cast<double>(runs.size());
    mean_y += std::log(run.fit.cpu) / static_cast<double>(runs.size());
  }
  double xx = 0.0, xy = 0.0;
  std::string steps;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const double x = std::log(size(runs[i])) - mean_x;
    xx += x * x;
    xy += x * (std::log(runs[i].fit.cpu) - mean_y);
    if (i > 0) {
      steps += fmt::format(
          " {:.2f}", std::log(runs[i].fit.cpu / runs[i - 1].fit.cpu) / std::log(size(runs[i]) / size(runs[i - 1])));
    }
  }
  fmt::print("CPU time ~ ({})^{:.2f}; from size to size:{}\n", name, xy / xx, steps);
}

template <class Chosen>
std::vector<Run> only(const std::vector<Run>& runs, const Chosen& chosen) {
  std::vector<Run> result;
  std::ranges::copy_if(runs, std::back_inserter(result), chosen);
  return result;
}

void summarise(const std::vector<Run>& runs) {
  const auto by_rows = only(runs, [](const Run& run) { return run.inputs == 10 && run.threads == 1; });
  fmt::print("\nOne thread, 10 inputs, 1e3 rows and more:\n");
  print_exponent("n", by_rows, [](const Run& run) { return static_cast<double>(run.rows); });
  print_exponent("n log n", by_rows, [](const Run& run) {
    const double rows = static_cast<double>(run.rows);
    return rows * std::log(rows);
  });
  fmt::print("\nOne thread, 1e5 rows, 2 to 32 inputs:\n");
  print_exponent("d", only(runs, [](const Run& run) { return run.rows == 100000 && run.threads == 1; }),
                 [](const Run& run) { return static_cast<double>(run.inputs); });
  fmt::print("\nOne thread against two, wall time:\n");
  for (const Run& one : runs) {
    for (const Run& two : runs) {
      if (one.threads == 1 && two.threads == 2 && one.inputs == two.inputs && one.rows == two.rows) {
        fmt::print("{} rows, {} inputs: {:.2f}\n", one.rows, one.inputs, one.fit.wall / two.fit.wall);
      }
    }
  }
}

void study(double max_rows, double seconds) {
  fmt::print("{:>9} {:>7} {:>8} {:>10} {:>10} {:>10} {:>8} {:>7} {:>10} {:>8}\n", "rows", "inputs", "threads",
             "fit wall s", "fit CPU s", "CPU s/1e6", "rmse", "leaves", "extra MiB", "x data");
  std::vector<Run> runs;
  for (const Eigen::Index inputs : {2, 5, 10, 20, 32}) {
    double feasible = max_rows;
    for (const int threads : {1, 2}) {
      for (Eigen::Index rows = 1000; static_cast<double>(rows) <= feasible; rows *= 10) {
        const auto run = measure_apart({rows, inputs, threads}, static_cast<rlim_t>(seconds));
        if (run) {
          print(*run);
          runs.push_back(*run);
        } else {
          fmt::print("{:9} {:7} {:8} not finished within {} CPU s\n", rows, inputs, threads, seconds);
          feasible = static_cast<double>(rows) - 1.0;
        }
      }
    }
  }
  summarise(runs);
}

}  // namespace

void add_fits(CLI::App& program) {
  struct Arguments {
    double max_rows = 1e6, seconds = 600.0;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("fits", "Time, memory and error of whole fits");
  command->add_option("--max-rows", arguments->max_rows, "largest number of training rows")
      ->check(CLI::Range(1e3, 1e9))
      ->capture_default_str();
  command->add_option("--seconds", arguments->seconds, "CPU seconds that a fit may take")
      ->check(CLI::Range(1.0, 1e9))
      ->capture_default_str();
  command->callback([arguments] { study(arguments->max_rows, arguments->seconds); });
}

}  // namespace bench
