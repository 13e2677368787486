#include "dynamics/delays.hpp"

#include <algorithm>
#include <functional>
#include <limits>

#include "dynamics/grid.hpp"

namespace llmt {
namespace {

constexpr int most_delay = 10;
constexpr int most_delay_asked_for = 40;

// The errors of linear models with a dead time of 0 to `most` rows of one input.
std::vector<double> errors_of_delays(const Task& task, const std::vector<StretchFold>& folds, bool on_runs, int most,
                                     const std::function<Lags(int)>& lags_with, Work& work) {
  std::vector<Trial> trials;
  for (int delay = 0; delay <= most; ++delay) trials.push_back({{.lags = lags_with(delay), .on_runs = on_runs}});
  try_on(task, folds, search_iterations, trials, work);
  std::vector<double> errors;
  for (const Trial& trial : trials) errors.push_back(trial.error);
  return errors;
}

// Errors that are as small as the smallest one.
constexpr double as_small = 1.02;

}  // namespace

std::vector<int> no_delays(const Task& task) {
  std::vector<int> delays;
  for (const Signal& input : task.inputs) delays.push_back(input.low < input.high ? 0 : -1);
  return delays;
}

std::vector<int> find_delays(const Task& task, const std::vector<StretchFold>& folds, bool on_runs, Work& work) {
  const Eigen::Index outputs = task.series.outputs.cols();
  std::vector<int> delays = no_delays(task);
  for (std::size_t i = 0; i < delays.size(); ++i) {
    if (delays[i] < 0) continue;
    Work part(work, 1.0 / static_cast<double>(delays.size()));
    const std::vector<double> errors = errors_of_delays(
        task, folds, on_runs, most_delay,
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
  const int most = static_cast<int>(std::min<Eigen::Index>(most_delay_asked_for, rows / 20));
  std::vector<int> found = delays;
  for (int& delay : found) delay = std::max(delay, 0);
  for (std::size_t i = 0; i < delays.size(); ++i) {
    const bool never_changes = !(task.inputs[i].low < task.inputs[i].high);
    if (delays[i] != find_delay || lags.inputs[i].empty() || never_changes) continue;
    Work part(work, 1.0 / static_cast<double>(delays.size()));
    const std::vector<double> errors = errors_of_delays(
        task, folds, task.horizon != 1, most,
        [&](int delay) {
          std::vector<int> tried = found;
          tried[i] = delay;
          return delayed(lags, tried);
        },
        part);
    const double best = std::ranges::min(errors);
    for (std::size_t delay = 0; delay < errors.size(); ++delay) {
      if (errors[delay] <= as_small * best) found[i] = static_cast<int>(delay);
    }
  }
  return found;
}

}  // namespace llmt
