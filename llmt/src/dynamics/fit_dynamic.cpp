#include "llmt/fit_dynamic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dynamics/choice.hpp"
#include "dynamics/delays.hpp"
#include "dynamics/held_out_runs.hpp"
#include "dynamics/model_structure.hpp"
#include "dynamics/other_orders.hpp"
#include "dynamics/windows.hpp"
#include "llmt/static_curve.hpp"

namespace llmt {
namespace {

constexpr int estimate_iterations = 60;
constexpr double hardly_worse = 1.1;  // what a calm model may cost

RunErrors errors_of(const Judged& judged, const Eigen::VectorXd& scale) {
  RunErrors errors;
  errors.rmse = (judged.squares / judged.rows).cwiseSqrt();
  errors.fit = 100.0 * (1.0 - errors.rmse.array() / scale.array());
  errors.rows = static_cast<Eigen::Index>(judged.rows);
  errors.runs = judged.runs;
  errors.diverged = judged.diverged;
  return errors;
}

std::string continuation_of(const ModelStructure& candidate) {
  if (candidate.degree == 0) return "guarded";
  return candidate.degree > 1 && !candidate.is_held ? "polynomial" : "linear";
}

// The stretches over which the chosen model was judged; the first `count` of them hold out every row once.
std::vector<StretchFold> folds_of(const std::vector<Stretch>& stretches, Eigen::Index rows, Eigen::Index& count) {
  if (rows > search_rows) {
    count = 3;
    return {every_third(stretches, 9, 2), every_third(stretches, 9, 0), every_third(stretches, 9, 1)};
  }
  std::vector<StretchFold> folds = cut(stretches, 4);
  count = std::ssize(folds);
  for (StretchFold& fold : cut(stretches, 7)) folds.push_back(std::move(fold));
  return folds;
}

// Whether every state of rest within the range of the record is stable, and runs over the record's inputs in other
// orders stay within their bounds.
bool is_calm(const Task& task, const DynamicParts& parts, const std::vector<Stretch>& stretches) {
  const DynamicModel model(parts);
  for (Eigen::Index input = 0; input < model.num_inputs(); ++input) {
    const StaticCurve curve = static_curve(model, input);
    if (std::ranges::any_of(curve.points, [](const RestPoint& rest) { return rest.is_inside && !rest.is_stable; })) {
      return false;
    }
  }
  return stays_over_other_orders(task, parts, stretches);
}

DynamicCandidate compared(const Task& task, const Trial& trial) {
  DynamicCandidate result;
  result.description = description_of(trial.candidate);
  result.lags = trial.candidate.lags;
  result.error = trial.error;
  result.one_step = std::sqrt(trial.judged.one_step / (trial.judged.rows * static_cast<double>(task.outputs.size())));
  result.is_linear = trial.candidate.is_linear();
  result.is_stable = trial.judged.diverged == 0;
  return result;
}

}  // namespace

DynamicFit fit_dynamic(const Series& series, const DynamicOptions& options, const Progress& progress) {
  check_series(series);
  Work work(progress);
  if (options.lags) {
    check_lags(*options.lags);
    if (std::ssize(options.lags->outputs) != series.outputs.cols() ||
        std::ssize(options.lags->inputs) != series.inputs.cols()) {
      throw std::invalid_argument("llmt::fit_dynamic: lags are needed for each output and input of the series");
    }
  }
  if (options.horizon < 0) {
    throw std::invalid_argument(fmt::format("llmt::fit_dynamic: the horizon is {}, it is 0 or more", options.horizon));
  }
  if (!options.delays.empty() && std::ssize(options.delays) != series.inputs.cols()) {
    throw std::invalid_argument("llmt::fit_dynamic: a delay is needed for each input of the series");
  }
  for (const int delay : options.delays) {
    if (delay != find_delay && (delay < 0 || delay > most_lag)) {
      throw std::invalid_argument(
          fmt::format("llmt::fit_dynamic: a delay is {}, it is find_delay or 0 to {}", delay, most_lag));
    }
  }
  Eigen::Index memory = 0;
  if (options.lags) {
    Lags lags = *options.lags;
    std::vector<int> given = without_marks(options.delays);
    given.resize(lags.inputs.size(), 0);
    lags = delayed(std::move(lags), given);
    check_lags(lags);
    memory = longest_lag(lags);
  } else {
    for (const int delay : options.delays) memory = std::max<Eigen::Index>(memory, delay);
  }
  const std::vector<Stretch> stretches = complete_stretches(series, memory + 2);
  Eigen::Index rows = 0;
  for (const Stretch& stretch : stretches) rows += stretch.rows();
  if (rows < std::max(fewest_dynamic_rows, 10 * memory)) {
    const std::string where =
        memory > 0 ? fmt::format("lags reach {} rows back, and in stretches longer than that ", memory) : "";
    throw std::invalid_argument(fmt::format("llmt::fit_dynamic: {}there are {} complete rows; {} are needed", where,
                                            rows, std::max(fewest_dynamic_rows, 10 * memory)));
  }
  Task task = task_of(series, options);
  for (std::size_t o = 0; o < task.outputs.size(); ++o) {
    if (task.scale(static_cast<Eigen::Index>(o)) > 0.0) continue;
    throw std::invalid_argument(
        fmt::format("llmt::fit_dynamic: the output \"{}\" never changes", task.outputs[o].name));
  }
  Work choosing(work, 0.9);
  const Chosen chosen = choose(task, stretches, options, choosing);
  work.begin("estimating");
  std::size_t taken = chosen.chosen;
  DynamicParts parts = estimate(task, chosen.trials[taken].candidate, stretches, estimate_iterations);
  Judged training = judge(task, parts, stretches);
  bool calm = training.diverged == 0 && is_calm(task, parts, stretches);
  // A model that leaves its bounds over its own records gives way to the next best that does not, and one that is not
  // calm to a calm one that is hardly worse.
  const double least = chosen.trials[taken].error;
  for (std::size_t k = 0; k < chosen.trials.size() && !calm; ++k) {
    const Trial& trial = chosen.trials[k];
    if (k == taken || trial.judged.diverged > 0) continue;
    if (training.diverged == 0 && trial.error > hardly_worse * least) continue;
    DynamicParts other = estimate(task, trial.candidate, stretches, estimate_iterations);
    const Judged of_other = judge(task, other, stretches);
    if (of_other.diverged > 0) continue;
    calm = is_calm(task, other, stretches);
    if (!calm && training.diverged == 0) continue;
    taken = k;
    parts = std::move(other);
    training = of_other;
  }
  const Trial& best = chosen.trials[taken];
  parts.is_stable = best.judged.diverged == 0 && training.diverged == 0;
  Eigen::Index whole = 0;
  const std::vector<StretchFold> folds = folds_of(stretches, rows, whole);
  const int iterations = rows > search_rows ? final_iterations : search_iterations;
  Work running(work, 0.5 * work.left());
  HeldOutRuns held_out = held_out_runs(task, best.candidate, folds, whole, iterations, running);
  parts.band = std::move(held_out.band);
  DynamicFit fit{DynamicModel(std::move(parts)), {}, {}, std::move(held_out.simulated)};
  DynamicSummary& summary = fit.summary;
  summary.rows = rows;
  for (const Trial& trial : chosen.trials) summary.compared.push_back(compared(task, trial));
  summary.chosen = taken;
  summary.delays = chosen.delays;
  summary.continuation = continuation_of(best.candidate);
  summary.held_out = errors_of(best.judged, task.scale);
  for (const Trial& trial : chosen.trials) {
    if (!trial.candidate.is_linear()) continue;
    summary.linear = errors_of(trial.judged, task.scale);
    break;
  }
  summary.training = errors_of(training, task.scale);
  fit.simulated.setConstant(series.rows(), series.outputs.cols(), std::nan(""));
  const Eigen::VectorXd lower = lower_bounds(task.outputs);
  const Eigen::VectorXd upper = upper_bounds(task.outputs);
  Eigen::MatrixXd simulated;
  for (const Window& window : windows_of(stretches, fit.model.memory(), options.horizon)) {
    run_window(fit.model.parts(), series, window, lower, upper, simulated);
    const Eigen::Index count = window.end - window.first;
    fit.simulated.middleRows(window.first, count) = simulated.bottomRows(count);
  }
  work.finish();
  return fit;
}

RunErrors run_errors(const DynamicModel& model, const Series& series, Eigen::Index initial, Eigen::Index horizon) {
  check_series(series);
  if (series.inputs.cols() != model.num_inputs() || series.outputs.cols() != model.num_outputs()) {
    throw std::invalid_argument("llmt::run_errors: the series has other signals than the model");
  }
  const Eigen::Index given = std::max(initial, model.memory());
  const Task task = task_of(series, {});
  const Judged judged =
      judge_runs(model.parts(), series, windows_of(complete_stretches(series, given + 1), given, horizon));
  if (judged.runs == 0) throw std::invalid_argument("llmt::run_errors: no stretch of complete rows is long enough");
  return errors_of(judged, task.scale);
}

}  // namespace llmt
