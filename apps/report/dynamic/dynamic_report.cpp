#include "report/dynamic/dynamic_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "llmt/csv.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

constexpr std::size_t shown_candidates = 8;

std::vector<std::string> signal_names(const std::vector<Signal>& signals) {
  std::vector<std::string> names;
  for (const Signal& signal : signals) names.push_back(signal.name);
  return names;
}

std::string lags_text(const DynamicModel& model, const Lags& lags) {
  return text_of(lags, signal_names(model.parts().inputs), signal_names(model.parts().outputs));
}

std::string run_time_text(double time, const std::string& unit) { return number(time, 6) + " " + unit; }

std::string error_rows(const DynamicRun& run, std::size_t width) {
  const DynamicSummary& summary = run.fit.summary;
  Table table({"output", "held-out RMSE", "fit %", "linear RMSE", "fit %", "training RMSE"});
  const std::vector<Signal>& outputs = run.fit.model.parts().outputs;
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    const auto at = static_cast<Eigen::Index>(o);
    table.add({outputs[o].name, number(summary.held_out.rmse(at)), fmt::format("{:.2f}", summary.held_out.fit(at)),
               number(summary.linear.rmse(at)), fmt::format("{:.2f}", summary.linear.fit(at)),
               number(summary.training.rmse(at))});
  }
  return table.text(width);
}

std::string pole_text(const Pole& pole) {
  if (std::abs(pole.z.imag()) < 1e-12 && pole.z.real() > 0.0) return number(pole.time_constant);
  return fmt::format("{} (damping {})", number(pole.frequency), number(pole.damping, 3));
}

// "0.12, 3.4 (damping 0.2)": time constants of real poles, frequencies of the others, each pair once.
std::string poles_text(const std::vector<Pole>& poles) {
  std::string text;
  for (const Pole& pole : poles) {
    if (pole.z.imag() < 0.0) continue;
    text += (text.empty() ? "" : ", ") + pole_text(pole);
  }
  return text.empty() ? "none" : text;
}

std::string local_table(const DynamicModel& model, std::size_t width) {
  const std::string unit = model.parts().time_unit;
  Table table({"where", fmt::format("time constants in {0}, or frequencies in 1/{0}", unit), "steady gain", "stable"});
  for (const LocalDynamics& local : local_dynamics(model)) {
    std::string gains;
    for (Eigen::Index o = 0; o < local.steady_gain.rows(); ++o) {
      for (Eigen::Index i = 0; i < local.steady_gain.cols(); ++i) {
        const double gain = local.steady_gain(o, i);
        gains += (gains.empty() ? "" : ", ") + (std::isfinite(gain) ? number(gain) : "integrates");
      }
    }
    table.add({local.where, poles_text(local.poles), gains, local.is_stable ? "yes" : "no"});
  }
  return table.text(width);
}

std::string tests_text(const std::vector<ResidualTests>& all) {
  std::string text;
  for (const ResidualTests& tests : all) {
    text += fmt::format(
        "Residuals of {}: {} of {} autocorrelations of next-row errors are outside of +-{}; {} of {} correlations of "
        "run errors with the inputs are outside of their bounds (99 %, so about 1 in 100 is by chance)\n",
        tests.output, tests.autocorrelations_outside(), tests.autocorrelation.size(),
        number(tests.autocorrelation_bound, 2), tests.cross_correlations_outside(), tests.cross_correlation.size());
  }
  return text;
}

Json number_array(const Eigen::VectorXd& values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(finite_or_null(value));
  return json;
}

Json number_rows(const Eigen::MatrixXd& matrix) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) json.push_back(number_array(matrix.row(i).transpose()));
  return json;
}

Json errors_json(const RunErrors& errors) {
  return {{"rmse", number_array(errors.rmse)},
          {"fit_per_cent", number_array(errors.fit)},
          {"rows", errors.rows},
          {"runs", errors.runs},
          {"diverged", errors.diverged}};
}

Json local_json(const LocalDynamics& local) {
  Json poles = Json::array();
  for (const Pole& pole : local.poles) {
    poles.push_back({{"re", pole.z.real()},
                     {"im", pole.z.imag()},
                     {"frequency", finite_or_null(pole.frequency)},
                     {"damping", finite_or_null(pole.damping)},
                     {"time_constant", finite_or_null(pole.time_constant)}});
  }
  return {{"where", local.where},
          {"poles", std::move(poles)},
          {"steady_gain", number_rows(local.steady_gain)},
          {"stable", local.is_stable}};
}

// The candidate that the errors of the next row alone would have chosen.
const DynamicCandidate& by_next_row(const DynamicSummary& summary) {
  return *std::ranges::min_element(summary.compared, {}, &DynamicCandidate::one_step);
}

}  // namespace

std::string dynamic_text(const DynamicRun& run, std::size_t width) {
  const DynamicSummary& summary = run.fit.summary;
  const DynamicModel& model = run.fit.model;
  const DynamicCandidate& chosen = summary.compared[summary.chosen];
  std::string text =
      fmt::format("{}: {} rows of {} {} each, {} input{}, {} output{}\n", run.data, summary.rows,
                  number(model.parts().sample_time, 6), model.parts().time_unit, model.num_inputs(),
                  model.num_inputs() == 1 ? "" : "s", model.num_outputs(), model.num_outputs() == 1 ? "" : "s");
  text += fmt::format("Model: {}\nLags: {}\n", chosen.description, lags_text(model, chosen.lags));
  for (const Signal& input : model.parts().inputs) {
    if (input.low == input.high) text += fmt::format("{} never changes, so nothing is learned from it\n", input.name);
  }
  text += fmt::format("Outside of the training ranges it goes on as: {}\n", summary.continuation);
  for (const Signal& output : model.parts().outputs) {
    if (std::isfinite(output.lower_stop)) text += fmt::format("{} has a stop at {}\n", output.name, output.lower_stop);
    if (std::isfinite(output.upper_stop)) text += fmt::format("{} has a stop at {}\n", output.name, output.upper_stop);
  }
  text += fmt::format("\nErrors of {} on held-out stretches ({} runs, {} left their bounds):\n",
                      run.horizon == 0 ? std::string("free runs")
                                       : fmt::format("runs of {} row{}", run.horizon, run.horizon == 1 ? "" : "s"),
                      summary.held_out.runs, summary.held_out.diverged);
  text += error_rows(run, width);
  Table table({"error", "next row", "model", "lags"});
  for (std::size_t k = 0; k < std::min(summary.compared.size(), shown_candidates); ++k) {
    const DynamicCandidate& candidate = summary.compared[k];
    table.add({number(candidate.error), number(candidate.one_step),
               candidate.description + (candidate.is_stable ? "" : " (unstable)"), lags_text(model, candidate.lags)});
  }
  text += "\nThe best of those compared; errors in standard deviations of the output:\n" + table.text(width);
  const DynamicCandidate& other = by_next_row(summary);
  text += fmt::format("Errors of the next row alone would have chosen one of error {}: {}\n", number(other.error),
                      other.description);
  text += "\nLocal dynamics:\n" + local_table(model, width) + "\n";
  text += tests_text(residual_tests(model, run.series, run.fit.simulated));
  return text;
}

Json dynamic_json(const DynamicRun& run) {
  const DynamicSummary& summary = run.fit.summary;
  const DynamicModel& model = run.fit.model;
  Json json = {{"data", run.data},
               {"rows", summary.rows},
               {"sample_time", model.parts().sample_time},
               {"time_unit", model.parts().time_unit},
               {"inputs", signal_names(model.parts().inputs)},
               {"outputs", signal_names(model.parts().outputs)},
               {"lags", lags_text(model, model.parts().lags)},
               {"horizon", run.horizon},
               {"model_kind", summary.compared[summary.chosen].description},
               {"continuation", summary.continuation},
               {"stable", model.parts().is_stable},
               {"held_out", errors_json(summary.held_out)},
               {"linear", errors_json(summary.linear)},
               {"training", errors_json(summary.training)}};
  json["compared"] = Json::array();
  for (const DynamicCandidate& candidate : summary.compared) {
    json["compared"].push_back({{"description", candidate.description},
                                {"lags", lags_text(model, candidate.lags)},
                                {"error", finite_or_null(candidate.error)},
                                {"next_row_error", finite_or_null(candidate.one_step)},
                                {"stable", candidate.is_stable}});
  }
  json["local_dynamics"] = Json::array();
  for (const LocalDynamics& local : local_dynamics(model)) json["local_dynamics"].push_back(local_json(local));
  json["residuals"] = Json::array();
  for (const ResidualTests& tests : residual_tests(model, run.series, run.fit.simulated)) {
    json["residuals"].push_back({{"output", tests.output},
                                 {"autocorrelation", number_array(tests.autocorrelation)},
                                 {"autocorrelation_bound", finite_or_null(tests.autocorrelation_bound)},
                                 {"cross_correlation", number_rows(tests.cross_correlation)},
                                 {"cross_correlation_bound", number_array(tests.cross_correlation_bound)}});
  }
  json["model"] = run.output.empty() ? Json(nullptr) : Json(run.output);
  return json;
}

namespace {

// RMSE and fit in per cent of the simulated rows that were measured too, one an output.
RunErrors errors_beside(const SimulatedRecords& simulated) {
  const Eigen::MatrixXd& measured = simulated.series.outputs;
  RunErrors errors;
  errors.rmse.setConstant(measured.cols(), std::nan(""));
  errors.fit = errors.rmse;
  const std::vector<Stretch> records = records_of(simulated.series);
  for (Eigen::Index o = 0; o < measured.cols(); ++o) {
    double squares = 0.0;
    double sum = 0.0;
    double of_measured = 0.0;
    double count = 0.0;
    for (std::size_t r = 0; r < records.size(); ++r) {
      for (Eigen::Index row = records[r].begin + simulated.runs[r].first; row < records[r].end; ++row) {
        const double error = measured(row, o) - simulated.outputs(row, o);
        if (!std::isfinite(error)) continue;
        squares += error * error;
        sum += measured(row, o);
        of_measured += measured(row, o) * measured(row, o);
        count += 1.0;
      }
    }
    if (count == 0.0) continue;
    errors.rmse(o) = std::sqrt(squares / count);
    const double variance = of_measured / count - sum / count * sum / count;
    if (variance > 0.0) errors.fit(o) = 100.0 * (1.0 - errors.rmse(o) / std::sqrt(variance));
    errors.rows = static_cast<Eigen::Index>(count);
  }
  errors.runs = std::ssize(records);
  for (const Run& run : simulated.runs) errors.diverged += run.left_at >= 0 ? 1 : 0;
  return errors;
}

}  // namespace

std::string simulated_text(const SimulatedRecords& simulated) {
  const DynamicParts& parts = simulated.model.parts();
  std::string text = fmt::format("{}: {} record{} of {} rows, begun by {} row{} each\n", simulated.data,
                                 simulated.runs.size(), simulated.runs.size() == 1 ? "" : "s", simulated.series.rows(),
                                 simulated.initial, simulated.initial == 1 ? "" : "s");
  if (simulated.has_measured) {
    const RunErrors errors = errors_beside(simulated);
    for (std::size_t o = 0; o < parts.outputs.size(); ++o) {
      const auto at = static_cast<Eigen::Index>(o);
      text +=
          fmt::format("{}: RMSE {}, fit {:.2f} %\n", parts.outputs[o].name, number(errors.rmse(at)), errors.fit(at));
    }
  }
  const std::vector<Stretch> records = records_of(simulated.series);
  for (std::size_t r = 0; r < records.size(); ++r) {
    const auto say = [&](Eigen::Index row, const char* what) {
      if (row < 0) return;
      text += fmt::format("Line {}, {} after its record begins: {}\n", simulated.lines[records[r].begin + row],
                          run_time_text(static_cast<double>(row) * parts.sample_time, parts.time_unit), what);
    };
    say(simulated.runs[r].outside_at, "the run leaves the data that the model was learned from");
    say(simulated.runs[r].left_at, "the run leaves all bounds and ends");
  }
  return text;
}

Json simulated_json(const SimulatedRecords& simulated) {
  const DynamicParts& parts = simulated.model.parts();
  Json json = {{"data", simulated.data}, {"rows", simulated.series.rows()}, {"outputs", signal_names(parts.outputs)}};
  if (simulated.has_measured) json["errors"] = errors_json(errors_beside(simulated));
  json["records"] = Json::array();
  for (const Run& run : simulated.runs) {
    const auto time = [&](Eigen::Index row) {
      return row < 0 ? Json(nullptr) : Json(static_cast<double>(row) * parts.sample_time);
    };
    json["records"].push_back(
        {{"first", run.first}, {"leaves_data_at", time(run.outside_at)}, {"leaves_bounds_at", time(run.left_at)}});
  }
  json["simulated"] = Json::object();
  for (std::size_t o = 0; o < parts.outputs.size(); ++o) {
    json["simulated"][parts.outputs[o].name] = number_array(simulated.outputs.col(static_cast<Eigen::Index>(o)));
  }
  return json;
}

std::string simulated_table(const SimulatedRecords& simulated) {
  std::vector<std::string> header;
  for (const Signal& output : simulated.model.parts().outputs) header.push_back(output.name + "_simulated");
  std::string text = csv_row(header) + "\n";
  for (Eigen::Index row = 0; row < simulated.outputs.rows(); ++row) {
    for (Eigen::Index o = 0; o < simulated.outputs.cols(); ++o) {
      const double value = simulated.outputs(row, o);
      if (o > 0) text += ",";
      if (std::isfinite(value)) text += fmt::format("{}", value);
    }
    text += "\n";
  }
  return text;
}

}  // namespace llmt::report
