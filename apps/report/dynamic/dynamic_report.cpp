#include "report/dynamic/dynamic_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/dynamic/dynamic_words.hpp"
#include "report/dynamic/local_words.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

constexpr std::size_t shown_candidates = 8;

std::string lags_text(const DynamicModel& model, const Lags& lags) {
  return text_of(lags, signal_names(model.parts().inputs), signal_names(model.parts().outputs));
}

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
      fmt::format("{}: {} rows of {} each, {} input{}, {} output{}\n", run.data, summary.rows,
                  run_time_text(model.parts().sample_time, model.parts().time_unit), model.num_inputs(),
                  model.num_inputs() == 1 ? "" : "s", model.num_outputs(), model.num_outputs() == 1 ? "" : "s");
  text += fmt::format("Model: {}\nLags: {}\n", chosen.description, lags_text(model, chosen.lags));
  for (std::size_t i = 0; i < summary.delays.size(); ++i) {
    const int rows = summary.delays[i];
    const std::string& input = model.parts().inputs[i].name;
    if (rows == no_delay_helps) {
      text += fmt::format(
          "Dead time of {0}: none that was tried helps a linear model. If {0} acts later, give it: "
          "--delay {0}:ROWS\n",
          input);
      continue;
    }
    text += fmt::format("Dead time of {}: {} row{}, {}; its lags count from there\n", input, rows, rows == 1 ? "" : "s",
                        run_time_text(rows * model.parts().sample_time, model.parts().time_unit));
  }
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
  text += error_rows(run, width) + band_text(model);
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
  text += static_text(model, width);
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
               {"delays", summary.delays},
               {"horizon", run.horizon},
               {"model_kind", summary.compared[summary.chosen].description},
               {"continuation", summary.continuation},
               {"stable", model.parts().is_stable},
               {"held_out", errors_json(summary.held_out)},
               {"linear", errors_json(summary.linear)},
               {"training", errors_json(summary.training)}};
  for (Json& delay : json["delays"]) {
    if (delay == no_delay_helps) delay = nullptr;
  }
  json["compared"] = Json::array();
  for (const DynamicCandidate& candidate : summary.compared) {
    json["compared"].push_back({{"description", candidate.description},
                                {"lags", lags_text(model, candidate.lags)},
                                {"error", finite_or_null(candidate.error)},
                                {"next_row_error", finite_or_null(candidate.one_step)},
                                {"stable", candidate.is_stable}});
  }
  json["band"] = band_json(model);
  json["local_dynamics"] = local_json(model);
  json["static_curves"] = static_json(model);
  json["residuals"] = Json::array();
  for (const ResidualTests& tests : residual_tests(model, run.series, run.fit.simulated)) {
    json["residuals"].push_back({{"output", tests.output},
                                 {"autocorrelation", number_array(tests.autocorrelation)},
                                 {"autocorrelation_bound", finite_or_null(tests.autocorrelation_bound)},
                                 {"cross_correlation", number_rows(tests.cross_correlation)},
                                 {"cross_correlation_bound", number_array(tests.cross_correlation_bound)},
                                 {"frequency", number_array(tests.frequency)},
                                 {"next_row_spectrum", number_array(tests.next_row_spectrum)},
                                 {"run_spectrum", number_array(tests.run_spectrum)}});
  }
  json["model"] = run.output.empty() ? Json(nullptr) : Json(run.output);
  return json;
}

}  // namespace llmt::report
