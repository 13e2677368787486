#include "dynamics/held_out_runs.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/parallel.hpp"

namespace llmt {
namespace {

constexpr Eigen::Index beginnings = 16;
constexpr std::size_t fewest_errors = 20;
constexpr std::size_t most_errors = 200;
// Errors that differ by less than this from one list to the next are pooled.
constexpr double growth = 1.1;

// Errors of an output after 1, 2 or 3, 4 to 7, 8 to 15, ... rows.
struct Pool {
  std::vector<double> errors = {};
  double rows = 0.0;  // sum

  double mean_square() const {
    double squares = 0.0;
    for (const double error : errors) squares += error * error;
    return squares / static_cast<double>(errors.size());
  }
  void operator+=(const Pool& other) {
    errors.insert(errors.end(), other.errors.begin(), other.errors.end());
    rows += other.rows;
  }
};

struct RunsOfFold {
  std::vector<std::vector<Pool>> pools;  // [output][power of two]
  std::vector<Window> windows = {};      // one a held-out stretch
  std::vector<Eigen::MatrixXd> simulated = {};
};

// The rows behind one where a run left its bounds count with the bound, as in judge_runs().
RunsOfFold runs_of(const Task& task, const DynamicParts& parts, const std::vector<Stretch>& held_out) {
  const Eigen::Index memory = longest_lag(parts.lags);
  const Eigen::VectorXd lower = lower_bounds(parts.outputs);
  const Eigen::VectorXd upper = upper_bounds(parts.outputs);
  RunsOfFold runs{std::vector<std::vector<Pool>>(task.outputs.size())};
  Eigen::MatrixXd simulated;
  for (const Window& whole : windows_of(held_out, memory)) {
    const Eigen::Index rows = whole.end - whole.first;
    const Eigen::Index step = std::max<Eigen::Index>(1, rows / beginnings);
    for (Eigen::Index skipped = 0; skipped < rows; skipped += step) {
      const Window window{whole.begin + skipped, whole.first + skipped, whole.end};
      const Eigen::Index left = run_window(parts, task.series, window, lower, upper, simulated);
      for (Eigen::Index row = window.first; row < window.end; ++row) {
        const auto since = static_cast<std::size_t>(row - window.first + 1);
        const std::size_t place = std::bit_width(since) - 1;
        for (std::size_t o = 0; o < runs.pools.size(); ++o) {
          const auto column = static_cast<Eigen::Index>(o);
          std::vector<Pool>& pools = runs.pools[o];
          if (pools.size() <= place) pools.resize(place + 1);
          const double value = left >= 0 && row >= left ? upper(column) : simulated(row - window.begin, column);
          pools[place].errors.push_back(std::abs(task.series.outputs(row, column) - value));
          pools[place].rows += static_cast<double>(since);
        }
      }
      if (skipped > 0) continue;
      runs.windows.push_back(window);
      runs.simulated.emplace_back(simulated.bottomRows(rows));
    }
  }
  return runs;
}

// Whether errors fall from list to list up to the one behind `last`: the noise of the rows that a run begins with dies
// away.
bool falls_up_to(const std::vector<Pool>& pools, std::size_t last) {
  for (std::size_t k = 0; k <= last; ++k) {
    if (!(growth * growth * pools[k + 1].mean_square() < pools[k].mean_square())) return false;
  }
  return true;
}

// Neighbours are pooled until each list has enough errors and they fall at first, if at all, and then grow.
void pool(std::vector<Pool>& pools) {
  for (std::size_t k = 0; k + 1 < pools.size();) {
    const bool is_few = pools[k].errors.size() < fewest_errors || pools[k + 1].errors.size() < fewest_errors;
    const bool grows = pools[k + 1].mean_square() >= growth * growth * pools[k].mean_square();
    if (!is_few && (grows || falls_up_to(pools, k))) {
      ++k;
      continue;
    }
    pools[k] += pools[k + 1];
    pools.erase(pools.begin() + static_cast<std::ptrdiff_t>(k) + 1);
    k = k > 0 ? k - 1 : 0;
  }
}

// At most so many of the sorted errors, at equal distances of their ranks.
std::vector<double> some_of(std::vector<double> errors) {
  std::ranges::sort(errors);
  if (errors.size() <= most_errors) return errors;
  std::vector<double> some;
  for (std::size_t k = 1; k <= most_errors; ++k) {
    some.push_back(errors[(errors.size() + 1) * k / (most_errors + 1) - 1]);
  }
  return some;
}

}  // namespace

HeldOutRuns held_out_runs(const Task& task, const ModelStructure& candidate, const std::vector<StretchFold>& folds,
                          Eigen::Index first, int iterations, Work& work) {
  std::vector<RunsOfFold> runs(folds.size());
  parallel_for(std::ssize(folds), task.max_threads, [&](Eigen::Index k) {
    runs[k] = runs_of(task, estimate(task, candidate, folds[k].train, iterations), folds[k].held_out);
    work.did(1.0 / static_cast<double>(folds.size()));
  });
  HeldOutRuns result;
  result.simulated.setConstant(task.series.rows(), task.series.outputs.cols(), std::nan(""));
  std::vector<std::vector<Pool>> pools(task.outputs.size());
  for (Eigen::Index k = 0; k < std::ssize(runs); ++k) {
    for (std::size_t w = 0; w < runs[k].windows.size(); ++w) {
      const Window& window = runs[k].windows[w];
      result.band.longest = std::max(result.band.longest, window.end - window.first);
      if (k < first) result.simulated.middleRows(window.first, window.end - window.first) = runs[k].simulated[w];
    }
    for (std::size_t o = 0; o < pools.size(); ++o) {
      const std::vector<Pool>& more = runs[k].pools[o];
      if (pools[o].size() < more.size()) pools[o].resize(more.size());
      for (std::size_t place = 0; place < more.size(); ++place) pools[o][place] += more[place];
    }
  }
  for (std::vector<Pool>& of_output : pools) {
    pool(of_output);
    std::vector<HeldOutErrors>& lists = result.band.outputs.emplace_back();
    for (Pool& each : of_output) {
      const double rows = each.rows / static_cast<double>(each.errors.size());
      lists.push_back({rows, some_of(std::move(each.errors))});
    }
  }
  return result;
}

}  // namespace llmt
