#include "report/dynamic/run_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "llmt/run_band.hpp"
#include "llmt/simulator.hpp"
#include "llmt/static_curve.hpp"
#include "report/document/figures.hpp"
#include "report/dynamic/local_words.hpp"

namespace llmt::report {
namespace {

constexpr std::size_t most_charts = 9;

std::string time_title(const DynamicModel& model) { return "time, " + model.parts().time_unit; }

std::string axis_title(const Signal& signal) {
  return signal.unit.empty() ? signal.name : signal.name + ", " + signal.unit;
}

// The rows of a run that are drawn: the first ones that were simulated.
Stretch drawn_rows(const DrawnRun& run, Eigen::Index output) {
  Stretch rows;
  while (rows.begin < run.outputs.rows() && !std::isfinite(run.outputs(rows.begin, output))) ++rows.begin;
  rows.end = std::min(run.outputs.rows(), rows.begin + most_points);
  return rows;
}

Numbers times_of(const DynamicModel& model, const Stretch& rows) {
  Numbers times;
  for (Eigen::Index row = rows.begin; row < rows.end; ++row) {
    times.push_back(static_cast<double>(row) * model.parts().sample_time);
  }
  return times;
}

Layer line(const std::string& name, const std::string& role, Numbers x, Numbers y) {
  return {.mark = Mark::line, .name = name, .role = role, .x = std::move(x), .y = std::move(y)};
}

// Lags 0 or 1, ... as places of bars.
Chart correlations(const std::string& title, const std::string& caption, const Eigen::VectorXd& values,
                   Eigen::Index first_lag, double bound) {
  Numbers lags;
  for (Eigen::Index k = 0; k < values.size(); ++k) lags.push_back(static_cast<double>(first_lag + k));
  return {.title = title,
          .caption = caption,
          .x = {"lag, rows"},
          .y = {"correlation"},
          .layers = {{.mark = Mark::bars, .role = "model", .x = std::move(lags), .y = numbers_of(values)}},
          .references = {{.value = bound, .name = "99 %"}, {.value = -bound}}};
}

}  // namespace

Chart run_chart(const DrawnRun& run, Eigen::Index output, const std::string& caption) {
  const Stretch rows = drawn_rows(run, output);
  const auto part = [&](const Eigen::MatrixXd& values) {
    return numbers_of(values.col(output).segment(rows.begin, rows.rows()));
  };
  const Signal& signal = run.model.parts().outputs[output];
  Chart chart{.title = fmt::format("{}: measured and simulated", signal.name),
              .caption = caption + (rows.rows() < run.outputs.rows() - rows.begin
                                        ? fmt::format(" The first {} rows of the run are drawn.", rows.rows())
                                        : ""),
              .x = {time_title(run.model)},
              .y = {axis_title(signal)},
              .layers = {},
              .wide = true};
  const Numbers times = times_of(run.model, rows);
  if (run.band.lower.rows() > 0) {
    chart.layers.push_back({.mark = Mark::band,
                            .name = "band",
                            .role = "model",
                            .x = times,
                            .y = part(run.outputs),
                            .low = part(run.band.lower),
                            .high = part(run.band.upper)});
  }
  chart.layers.push_back(line("measured", "data", times, part(run.series.outputs)));
  chart.layers.push_back(line("simulated", "model", times, part(run.outputs)));
  return chart;
}

std::vector<Chart> leaf_charts(const DrawnRun& run) {
  const auto* tree = std::get_if<Model>(&run.model.parts().rest);
  if (tree == nullptr) return {};
  // What the run has as its past: its own outputs, and measured ones before it began.
  Series series = run.series;
  for (Eigen::Index row = 0; row < series.rows(); ++row) {
    for (Eigen::Index o = 0; o < series.outputs.cols(); ++o) {
      if (std::isfinite(run.outputs(row, o))) series.outputs(row, o) = run.outputs(row, o);
    }
  }
  const Stretch shown = drawn_rows(run, 0);
  const Eigen::Index given = std::max<Eigen::Index>(run.model.memory(), 1);
  Eigen::MatrixXd leaves = Eigen::MatrixXd::Constant(series.rows(), std::ssize(tree->partitions()), std::nan(""));
  for (const Stretch& stretch : complete_stretches(series, given + 1)) {
    if (stretch.begin >= shown.end) break;
    const Eigen::Index rows = std::min(stretch.end, shown.end) - stretch.begin;
    if (rows <= given) continue;
    Simulator simulator(run.model);
    simulator.start(series.inputs.middleRows(stretch.begin, given), series.outputs.middleRows(stretch.begin, given));
    Eigen::MatrixXd regressors(rows - given, std::ssize(run.model.columns()));
    for (Eigen::Index row = given; row < rows; ++row) {
      simulator.step(series.inputs.row(stretch.begin + row).transpose(),
                     series.outputs.row(stretch.begin + row).transpose());
      regressors.row(row - given) = simulator.regressors().transpose();
    }
    leaves.middleRows(stretch.begin + given, rows - given) = tree->leaf_of(regressors).cast<double>().array() + 1.0;
  }
  std::vector<Chart> charts;
  for (std::size_t p = 0; p < tree->partitions().size(); ++p) {
    const auto partition = static_cast<Eigen::Index>(p);
    if (tree->leaves(partition).size() < 2) continue;
    const std::string of =
        tree->partitions().size() > 1 ? " of " + tree->outputs()[tree->partitions()[p].outputs.front()].name : "";
    Layer layer = line("", "model", times_of(run.model, shown),
                       numbers_of(leaves.col(partition).segment(shown.begin, shown.rows())));
    layer.steps = true;
    charts.push_back({.title = "The leaf that counts most" + of,
                      .caption = "Numbers of leaves are those of the local models.",
                      .x = {time_title(run.model)},
                      .y = {"leaf"},
                      .layers = {std::move(layer)},
                      .wide = true});
  }
  return charts;
}

std::vector<Chart> residual_charts(const ResidualTests& tests, const DynamicModel& model) {
  std::vector<Chart> charts;
  if (tests.frequency.size() > 0) {
    const Numbers frequency = numbers_of(tests.frequency);
    charts.push_back({.title = fmt::format("{}: spectrum of the errors", tests.output),
                      .caption = "Mean square for each unit of frequency. White errors have a level line; a peak is a "
                                 "motion that the model lacks.",
                      .x = {fmt::format("frequency, 1/{}", model.parts().time_unit)},
                      .y = {.title = "mean square / frequency", .log = true},
                      .layers = {line("of the next row", "data", frequency, numbers_of(tests.next_row_spectrum)),
                                 line("of runs", "model", frequency, numbers_of(tests.run_spectrum))}});
  }
  charts.push_back(correlations(
      fmt::format("{}: are errors of the next row white?", tests.output),
      fmt::format(
          "Correlation of each error with the one so many rows before. {} of {} are outside of the bounds, within "
          "which 99 % lie if they are white.",
          tests.autocorrelations_outside(), tests.autocorrelation.size()),
      tests.autocorrelation, 1, tests.autocorrelation_bound));
  for (Eigen::Index i = 0; i < tests.cross_correlation.rows(); ++i) {
    const std::string& input = model.parts().inputs[i].name;
    charts.push_back(correlations(
        fmt::format("{}: do errors of runs follow {}?", tests.output, input),
        fmt::format("Correlation of the errors of runs with {} so many rows before. Outside of the bounds the model "
                    "misses a part of what {} does, at this lag.",
                    input, input),
        tests.cross_correlation.row(i).transpose(), 0, tests.cross_correlation_bound(i)));
  }
  return charts;
}

std::vector<Chart> step_charts(const DynamicModel& model) {
  const DynamicParts& parts = model.parts();
  const std::vector<LocalDynamics> all = local_dynamics(model);
  const Eigen::Index rows = step_rows(all);
  const Numbers times = times_of(model, {0, rows});
  std::vector<Chart> charts;
  for (Eigen::Index i = 0; i < model.num_inputs(); ++i) {
    std::vector<Eigen::MatrixXd> responses;
    for (const LocalDynamics& local : all) responses.push_back(step_response(local, i, rows));
    for (Eigen::Index o = 0; o < model.num_outputs() && charts.size() < most_charts; ++o) {
      Chart chart{.title = fmt::format("Step response of {} to {}", parts.outputs[o].name, parts.inputs[i].name),
                  .caption = fmt::format("The change of {} after {} rises by 1 and stays, near each point.",
                                         parts.outputs[o].name, parts.inputs[i].name),
                  .x = {time_title(model)},
                  .y = {axis_title(parts.outputs[o])},
                  .layers = {}};
      constexpr std::array roles = {"model", "data", "before", "after", "up", "down", "muted"};
      for (std::size_t k = 0; k < all.size(); ++k) {
        Layer layer = line(all[k].where, roles[k % roles.size()], times, numbers_of(responses[k].col(o)));
        layer.steps = true;
        layer.dashed = k >= roles.size();
        chart.layers.push_back(std::move(layer));
      }
      charts.push_back(std::move(chart));
    }
  }
  return charts;
}

std::vector<Chart> static_charts(const DynamicModel& model) {
  const DynamicParts& parts = model.parts();
  std::vector<Chart> charts;
  if (has_sums(model)) return charts;
  for (Eigen::Index i = 0; i < model.num_inputs(); ++i) {
    if (!(parts.inputs[i].low < parts.inputs[i].high) || charts.size() >= most_charts) continue;
    const StaticCurve curve = static_curve(model, i);
    if (curve.points.empty()) continue;
    for (Eigen::Index o = 0; o < model.num_outputs() && charts.size() < most_charts; ++o) {
      Layer stable{.name = "stable", .role = "model"};
      Layer unstable{.name = "unstable", .role = "bad"};
      for (const RestPoint& point : curve.points) {
        Layer& layer = point.is_stable ? stable : unstable;
        layer.x.push_back(point.input);
        layer.y.push_back(point.outputs(o));
      }
      Chart chart{
          .title = fmt::format("{} at rest over {}", parts.outputs[o].name, parts.inputs[i].name),
          .caption = "The values that the model comes to rest at.",
          .x = {axis_title(parts.inputs[i])},
          .y = {axis_title(parts.outputs[o])},
          .layers = {stable},
          .references = {{.value = parts.outputs[o].low, .name = "training range"}, {.value = parts.outputs[o].high}}};
      if (model.num_inputs() > 1) chart.caption += " The other inputs are in the middle of their ranges.";
      if (!unstable.x.empty()) chart.layers.push_back(unstable);
      if (!curve.none.empty()) {
        chart.caption += fmt::format(" At {} of {} values none was found.", curve.none.size(),
                                     curve.none.size() + curve.points.size());
      }
      charts.push_back(std::move(chart));
    }
  }
  return charts;
}

Chart band_chart(const DynamicModel& model, Eigen::Index output) {
  const DynamicParts& parts = model.parts();
  const std::vector<HeldOutErrors>& lists = parts.band.outputs[output];
  Numbers times;
  Numbers widths;
  Numbers halves;
  for (const HeldOutErrors& list : lists) {
    times.push_back(list.rows * parts.sample_time);
    widths.push_back(half_width(model, output, list.rows, band_level));
    halves.push_back(half_width(model, output, list.rows, 0.5));
  }
  times.push_back(static_cast<double>(parts.band.longest) * parts.sample_time);
  widths.push_back(half_width(model, output, static_cast<double>(parts.band.longest), band_level));
  halves.push_back(half_width(model, output, static_cast<double>(parts.band.longest), 0.5));
  return {.title = fmt::format("{}: error over the time of a run", parts.outputs[output].name),
          .caption = "Half of the held-out errors are below the lower line, nine of ten below the upper one.",
          .x = {.title = "time since the run began, " + parts.time_unit},
          .y = {.title = fmt::format("error, {}", parts.outputs[output].unit.empty() ? parts.outputs[output].name
                                                                                     : parts.outputs[output].unit)},
          .layers = {line("90 %", "model", times, widths), line("50 %", "data", times, halves)}};
}

}  // namespace llmt::report
