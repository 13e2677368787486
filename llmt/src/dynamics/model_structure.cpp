#include "dynamics/model_structure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dynamics/one_step.hpp"
#include "dynamics/output_error.hpp"
#include "dynamics/polynomial.hpp"
#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/readable.hpp"

namespace llmt {
namespace {

// Fewer rows than this leave no tree to learn: the rest is left out.
constexpr Eigen::Index fewest_rows_of_rest = 20;

std::vector<std::string> names_of(const std::vector<Signal>& signals) {
  std::vector<std::string> names;
  for (const Signal& signal : signals) names.push_back(signal.name);
  return names;
}

TrainingData rest_data(const DynamicParts& parts, const RegressorRows& rows) {
  TrainingData data;
  data.inputs = rows.regressors;
  data.outputs = rows.outputs;
  data.may_have_codes = false;
  data.input_names = column_names(columns_of(parts.lags), names_of(parts.inputs), names_of(parts.outputs));
  data.output_names = names_of(parts.outputs);
  OneStep polynomial(parts);
  Eigen::VectorXd x;
  Eigen::VectorXd y(data.outputs.cols());
  for (Eigen::Index row = 0; row < data.inputs.rows(); ++row) {
    x = data.inputs.row(row).transpose();
    polynomial.values(x.data(), y.data());
    data.outputs.row(row) -= y.transpose();
  }
  return data;
}

// The tree as it is grown, with the candidate's leaves: its size is chosen by runs, not by rows.
FitOptions tree_options(const ModelStructure& candidate) {
  FitOptions options;
  options.rule = candidate.rule;
  options.max_leaves = candidate.leaves;
  options.folds.count = 0;
  options.choose_inputs = false;
  options.intervals = false;
  options.max_threads = 1;
  options.terms = candidate.is_quadratic ? LocalTerms::quadratic : LocalTerms::linear;
  const bool is_axis_parallel =
      candidate.rule == GrowthRule::rd || candidate.rule == GrowthRule::ra || candidate.rule == GrowthRule::retis;
  if (is_axis_parallel) options.validity = ValidityChoice::blend;
  if (candidate.rule == GrowthRule::rd || candidate.rule == GrowthRule::ra) options.significance = every_split;
  return options;
}

void add_rest(const Task& task, const ModelStructure& candidate, const RegressorRows& rows, DynamicParts& parts) {
  if (candidate.rest == RestKind::none || rows.regressors.rows() < fewest_rows_of_rest) return;
  TrainingData data = rest_data(parts, rows);
  switch (candidate.rest) {
    case RestKind::none:
      return;
    case RestKind::tree:
      parts.rest = fit(data, tree_options(candidate)).model;
      return;
    case RestKind::readable: {
      FitOptions options;
      options.folds.kind = FoldKind::contiguous;
      options.choose_inputs = false;
      options.intervals = false;
      options.max_threads = task.max_threads;
      options.validity = ValidityChoice::crisp;
      const PreparedFit prepared(std::move(data), options);
      parts.rest = fit_readable(prepared, fit(prepared).summary).model;
      return;
    }
    case RestKind::sum:
      parts.rest = fit_boosted(data, {.max_threads = task.max_threads}).model;
      return;
  }
}

// A row at a stop says only that the output would be beyond it.
RegressorRows without_stops(const Task& task, const Lags& lags, RegressorRows rows) {
  std::vector<Eigen::Index> kept;
  const auto is_at_stop = [&](Eigen::Index row, std::size_t o) {
    const double value = task.series.outputs(row, static_cast<Eigen::Index>(o));
    return value >= task.outputs[o].upper_stop || value <= task.outputs[o].lower_stop;
  };
  for (Eigen::Index k = 0; k < std::ssize(rows.rows); ++k) {
    bool is_free = true;
    for (std::size_t o = 0; o < task.outputs.size() && is_free; ++o) {
      is_free = !is_at_stop(rows.rows[k], o);
      for (const int lag : lags.outputs[o]) is_free = is_free && !is_at_stop(rows.rows[k] - lag, o);
    }
    if (is_free) kept.push_back(k);
  }
  if (2 * kept.size() < rows.rows.size() || kept.size() == rows.rows.size()) return rows;
  RegressorRows result{rows.regressors(kept, Eigen::all), rows.outputs(kept, Eigen::all), {}};
  for (const Eigen::Index k : kept) result.rows.push_back(rows.rows[k]);
  return result;
}

OutputErrorResult on_runs(const Task& task, const ModelStructure& candidate, const DynamicParts& start,
                          const std::vector<Window>& windows, int iterations) {
  return estimate_on_runs(start, task.series, windows, task.scale,
                          {.iterations = iterations, .ridge = candidate.ridge, .step_scale = task.step_scale});
}

// The polynomial with the coefficients of a linear one, and 0 elsewhere.
DynamicParts begun_linearly(DynamicParts parts, const DynamicParts& linear) {
  Eigen::MatrixXd& coefficients = parts.polynomial.coefficients;
  coefficients.setZero();
  coefficients.leftCols(linear.polynomial.coefficients.cols()) = linear.polynomial.coefficients;
  return parts;
}

}  // namespace

std::string description_of(const ModelStructure& candidate) {
  std::string text;
  if (candidate.degree == 1) text = "linear";
  if (candidate.degree > 1) text = fmt::format("polynomial of degree {}", candidate.degree);
  if (candidate.rest == RestKind::tree) {
    text += fmt::format("{}tree of {} {}leaves ({})", text.empty() ? "" : " and ", candidate.leaves,
                        candidate.is_quadratic ? "quadratic " : "", name_of(candidate.rule));
  }
  if (candidate.rest == RestKind::readable) text += text.empty() ? "readable tree" : " and readable tree";
  if (candidate.rest == RestKind::sum) text += text.empty() ? "sum of trees" : " and sum of trees";
  if (candidate.ridge > 0.0 && !candidate.is_linear()) text += fmt::format(", ridge {:g}", candidate.ridge);
  if (candidate.degree > 1) text += candidate.is_held ? ", held" : ", not held";
  if (candidate.has_stops) text += ", with stops";
  text += candidate.on_runs ? ", estimated on runs" : ", estimated on next rows";
  return text;
}

Task task_of(const Series& series, const DynamicOptions& options) {
  Task task{series, {}, {}, {}, {}, options.horizon, options.max_threads};
  const auto signals = [](const Eigen::MatrixXd& values, const std::vector<std::string>& names) {
    std::vector<Signal> result;
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
      Signal signal{names[j]};
      signal.low = std::numeric_limits<double>::infinity();
      signal.high = -signal.low;
      for (const double value : values.col(j)) {
        if (std::isnan(value)) continue;
        signal.low = std::min(signal.low, value);
        signal.high = std::max(signal.high, value);
      }
      result.push_back(signal);
    }
    return result;
  };
  task.inputs = signals(series.inputs, series.input_names);
  task.outputs = signals(series.outputs, series.output_names);
  task.scale.resize(series.outputs.cols());
  task.step_scale.resize(series.outputs.cols());
  for (Eigen::Index o = 0; o < series.outputs.cols(); ++o) {
    double sum = 0.0;
    double squares = 0.0;
    double steps = 0.0;
    double count = 0.0;
    double count_of_steps = 0.0;
    for (const Stretch& stretch : complete_stretches(series, 2)) {
      for (Eigen::Index row = stretch.begin; row < stretch.end; ++row) {
        const double value = series.outputs(row, o) - task.outputs[o].low;
        sum += value;
        squares += value * value;
        count += 1.0;
        if (row == stretch.begin) continue;
        const double step = series.outputs(row, o) - series.outputs(row - 1, o);
        steps += step * step;
        count_of_steps += 1.0;
      }
    }
    task.scale(o) = count > 0.0 ? std::sqrt(std::max(0.0, squares / count - sum / count * sum / count)) : 0.0;
    task.step_scale(o) = count_of_steps > 0.0 ? std::sqrt(steps / count_of_steps) : 0.0;
  }
  return task;
}

DynamicParts estimate_rows(const Task& task, const ModelStructure& candidate, const RegressorRows& rows) {
  DynamicParts parts;
  parts.inputs = task.inputs;
  parts.outputs = task.outputs;
  if (!candidate.has_stops) {
    for (Signal& output : parts.outputs) output = {output.name, output.unit, output.low, output.high};
  }
  parts.sample_time = task.series.sample_time;
  parts.time_unit = task.series.time_unit;
  parts.lags = candidate.lags;
  parts.polynomial = fit_polynomial(rows.regressors, rows.outputs, candidate.degree, candidate.on_runs ? 1e-6 : 0.0);
  parts.polynomial.is_held = candidate.degree > 1 && candidate.is_held;
  add_rest(task, candidate, rows, parts);
  return parts;
}

DynamicParts estimate(const Task& task, const ModelStructure& candidate, const std::vector<Stretch>& stretches,
                      int iterations) {
  const Eigen::Index memory = longest_lag(candidate.lags);
  RegressorRows rows = regressor_rows(task.series, candidate.lags, stretches, memory);
  if (candidate.has_stops) rows = without_stops(task, candidate.lags, std::move(rows));
  DynamicParts parts = estimate_rows(task, candidate, rows);
  const bool has_parameters = candidate.rest == RestKind::none || candidate.rest == RestKind::tree;
  if (!candidate.on_runs || !has_parameters) return parts;
  const std::vector<Window> windows = windows_of(stretches, memory, task.horizon);
  OutputErrorResult best = on_runs(task, candidate, parts, windows, iterations);
  if (candidate.degree > 1 && candidate.rest == RestKind::none) {
    // A second start: where next rows mislead, or their polynomial runs away, the linear model may lead further.
    ModelStructure linear = candidate;
    linear.degree = 1;
    const OutputErrorResult straight =
        on_runs(task, linear, estimate_rows(task, linear, rows), windows, std::min(iterations, 10));
    if (std::isfinite(straight.cost)) {
      const OutputErrorResult other =
          on_runs(task, candidate, begun_linearly(parts, straight.parts), windows, iterations);
      if (other.cost < best.cost) best = other;
    }
  }
  return std::isfinite(best.cost) ? best.parts : parts;
}

Judged& Judged::operator+=(const Judged& other) {
  if (squares.size() == 0) squares.setZero(other.squares.size());
  squares += other.squares;
  rows += other.rows;
  runs += other.runs;
  diverged += other.diverged;
  one_step += other.one_step;
  return *this;
}

Judged judge_runs(const DynamicParts& parts, const Series& series, const std::vector<Window>& windows) {
  const Eigen::VectorXd lower = lower_bounds(parts.outputs);
  const Eigen::VectorXd upper = upper_bounds(parts.outputs);
  Judged judged;
  judged.squares.setZero(series.outputs.cols());
  Eigen::MatrixXd simulated;
  for (const Window& window : windows) {
    const Eigen::Index left = run_window(parts, series, window, lower, upper, simulated);
    ++judged.runs;
    judged.diverged += left >= 0 ? 1 : 0;
    for (Eigen::Index row = window.first; row < window.end; ++row) {
      judged.rows += 1.0;
      for (Eigen::Index o = 0; o < simulated.cols(); ++o) {
        const double value = left >= 0 && row >= left ? upper(o) : simulated(row - window.begin, o);
        judged.squares(o) += std::pow(series.outputs(row, o) - value, 2);
      }
    }
  }
  return judged;
}

Judged judge(const Task& task, const DynamicParts& parts, const std::vector<Stretch>& stretches) {
  const Series& series = task.series;
  const Eigen::Index memory = longest_lag(parts.lags);
  Judged judged = judge_runs(parts, series, windows_of(stretches, memory, task.horizon));
  const RegressorRows rows = regressor_rows(series, parts.lags, stretches, memory);
  OneStep map(parts);
  Eigen::VectorXd x;
  Eigen::VectorXd y(series.outputs.cols());
  for (Eigen::Index k = 0; k < rows.outputs.rows(); ++k) {
    x = rows.regressors.row(k).transpose();
    map.values(x.data(), y.data());
    for (Eigen::Index o = 0; o < y.size(); ++o) {
      const double last = rows.last(k, o);
      const double value = held_at_stops(parts.outputs[o], y(o) + last) - last;
      judged.one_step += std::pow((rows.outputs(k, o) - value) / task.scale(o), 2);
    }
  }
  return judged;
}

double error_of(const Task& task, const Judged& judged) {
  const double outputs = static_cast<double>(judged.squares.size());
  return std::sqrt((judged.squares.array() / task.scale.array().square()).sum() / (outputs * judged.rows));
}

}  // namespace llmt
