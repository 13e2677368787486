#include "dynamics/delays.hpp"

#include <algorithm>
#include <functional>
#include <limits>

#include "dynamics/grid.hpp"

namespace llmt {
namespace {

constexpr int most_delay = 10;
constexpr int most_delay_asked_for = 40;

// Folds whose stretches begin so many rows later.
std::vector<StretchFold> later(const std::vector<StretchFold>& folds, Eigen::Index rows) {
  const auto shortened = [&](const std::vector<Stretch>& stretches) {
    std::vector<Stretch> rest;
    for (const Stretch& stretch : stretches) {
      if (stretch.begin + rows < stretch.end) rest.push_back({stretch.begin + rows, stretch.end});
    }
    return rest;
  };
  std::vector<StretchFold> result;
  for (const StretchFold& fold : folds) {
    StretchFold own{.train = shortened(fold.train), .held_out = shortened(fold.held_out)};
    if (!own.train.empty() && !own.held_out.empty()) result.push_back(std::move(own));
  }
  return result;
}

// The error of a linear model whose lags leave `spare` rows of the longest ones tried: with them all are judged by the
// same rows.
double error_of(const Task& task, const std::vector<StretchFold>& folds, bool on_runs, Lags lags, Eigen::Index spare,
                Work& work) {
  std::vector<Trial> trials = {{{.lags = std::move(lags), .on_runs = on_runs}}};
  try_on(task, later(folds, spare), search_iterations, trials, work);
  return trials.front().error;
}

// Those of linear models with a dead time of 0 to `most` rows of one input.
std::vector<double> errors_of_delays(const Task& task, const std::vector<StretchFold>& folds, bool on_runs, int most,
                                     const std::function<Lags(int)>& lags_with, Work& work) {
  std::vector<double> errors;
  for (int delay = 0; delay <= most; ++delay) {
    Work part(work, 1.0 / (most + 2.0));
    errors.push_back(error_of(task, folds, on_runs, lags_with(delay), most - delay, part));
  }
  return errors;
}

// A dead time that leaves at least half of the longest stretch.
int at_most(int most, const std::vector<StretchFold>& folds) {
  Eigen::Index longest = 0;
  for (const StretchFold& fold : folds) {
    for (const Stretch& stretch : fold.held_out) longest = std::max(longest, stretch.rows());
  }
  return static_cast<int>(std::min<Eigen::Index>(most, longest / 2));
}

// Errors that are as small as the smallest one.
constexpr double as_small = 1.02;

}  // namespace

std::vector<int> no_delays(const Task& task) {
  std::vector<int> delays;
  for (const Signal& input : task.inputs) delays.push_back(input.low < input.high ? 0 : -1);
  return delays;
}

std::vector<int> without_marks(std::vector<int> delays) {
  for (int& delay : delays) delay = std::max(delay, 0);
  return delays;
}

std::vector<int> find_delays(const Task& task, const std::vector<StretchFold>& folds, bool on_runs, Work& work) {
  const Eigen::Index outputs = task.series.outputs.cols();
  std::vector<int> delays = no_delays(task);
  for (std::size_t i = 0; i < delays.size(); ++i) {
    if (delays[i] < 0) continue;
    Work part(work, 1.0 / static_cast<double>(delays.size()));
    const std::vector<double> errors = errors_of_delays(
        task, folds, on_runs, at_most(most_delay, folds),
        [&](int delay) {
          std::vector<int> tried = delays;
          tried[i] = delay;
          return simple_lags(tried, outputs, 2, 2);
        },
        part);
    double best = std::numeric_limits<double>::infinity();
    for (const double error : errors) best = std::min(best, error);
    const auto first = std::ranges::find_if(errors, [&](double error) { return error <= as_small * best; });
    delays[i] = first == errors.end() ? 0 : static_cast<int>(first - errors.begin());
  }
  return delays;
}

std::vector<int> asked_delays(const Task& task, const std::vector<StretchFold>& folds, const Lags& lags,
                              std::vector<int> delays, Eigen::Index rows, Work& work) {
  const int most = at_most(static_cast<int>(std::min<Eigen::Index>(most_delay_asked_for, rows / 20)), folds);
  std::vector<int> found = without_marks(delays);
  for (std::size_t i = 0; i < delays.size(); ++i) {
    const bool never_changes = !(task.inputs[i].low < task.inputs[i].high);
    if (delays[i] != find_delay || lags.inputs[i].empty() || never_changes) continue;
    const bool on_runs = task.horizon != 1;
    Work part(work, 1.0 / static_cast<double>(delays.size()));
    const std::vector<double> errors = errors_of_delays(
        task, folds, on_runs, most,
        [&](int delay) {
          std::vector<int> tried = found;
          tried[i] = delay;
          return delayed(lags, without_marks(tried));
        },
        part);
    const double best = std::ranges::min(errors);
    // An input that explains nothing has no dead time.
    Lags without = delayed(lags, without_marks(found));
    without.inputs[i].clear();
    if (!columns_of(without).empty() && error_of(task, folds, on_runs, without, most, part) <= as_small * best) {
      found[i] = no_delay_helps;
      continue;
    }
    for (std::size_t delay = 0; delay < errors.size(); ++delay) {
      if (errors[delay] <= as_small * best) found[i] = static_cast<int>(delay);
    }
  }
  return found;
}

}  // namespace llmt
