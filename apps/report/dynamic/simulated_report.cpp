#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "llmt/csv.hpp"
#include "report/dynamic/dynamic_report.hpp"
#include "report/dynamic/dynamic_words.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
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

// The share of the measured values of an output that lie in the band, of the simulated rows. NaN: there are none.
double share_inside(const SimulatedRecords& simulated, Eigen::Index output) {
  const std::vector<Stretch> records = records_of(simulated.series);
  double inside = 0.0;
  double count = 0.0;
  for (std::size_t r = 0; r < records.size(); ++r) {
    for (Eigen::Index row = records[r].begin + simulated.runs[r].first; row < records[r].end; ++row) {
      const double value = simulated.series.outputs(row, output);
      if (!std::isfinite(value)) continue;
      count += 1.0;
      // A run that has ended holds nothing.
      if (value >= simulated.band.lower(row, output) && value <= simulated.band.upper(row, output)) inside += 1.0;
    }
  }
  return inside / count;
}

// Rows of the longest run.
Eigen::Index longest_run(const SimulatedRecords& simulated) {
  const std::vector<Stretch> records = records_of(simulated.series);
  Eigen::Index longest = 0;
  for (std::size_t r = 0; r < records.size(); ++r) {
    longest = std::max(longest, records[r].rows() - simulated.runs[r].first);
  }
  return longest;
}

// How far the held-out runs went, where a run goes on for longer.
std::string beyond_held_out(const SimulatedRecords& simulated) {
  const DynamicParts& parts = simulated.model.parts();
  if (simulated.level == 0.0 || longest_run(simulated) <= parts.band.longest) return "";
  const bool grows = std::ranges::any_of(parts.lags.adds_up, [](bool each) { return each; });
  return fmt::format("The held-out runs had at most {} rows, {}; beyond that the band {}, which no run has tested\n",
                     parts.band.longest,
                     run_time_text(static_cast<double>(parts.band.longest) * parts.sample_time, parts.time_unit),
                     grows ? "of an output that adds up grows with the time" : "stays as wide as it is there");
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
      const double inside = simulated.level > 0.0 ? share_inside(simulated, at) : std::nan("");
      if (std::isnan(inside)) continue;
      text += fmt::format("{}: {:.1f} % of the measured values lie in the band of {:g} %\n", parts.outputs[o].name,
                          100.0 * inside, 100.0 * simulated.level);
    }
  }
  text += beyond_held_out(simulated);
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
  const auto by_output = [&](const Eigen::MatrixXd& values) {
    Json columns = Json::object();
    for (std::size_t o = 0; o < parts.outputs.size(); ++o) {
      columns[parts.outputs[o].name] = number_array(values.col(static_cast<Eigen::Index>(o)));
    }
    return columns;
  };
  json["simulated"] = by_output(simulated.outputs);
  if (simulated.level > 0.0) {
    Eigen::VectorXd inside(simulated.outputs.cols());
    for (Eigen::Index o = 0; o < inside.size(); ++o) inside(o) = share_inside(simulated, o);
    json["interval"] = simulated.level;
    json["longest_held_out_run"] = parts.band.longest;
    if (simulated.has_measured) json["inside"] = number_array(inside);
    json["low"] = by_output(simulated.band.lower);
    json["high"] = by_output(simulated.band.upper);
  }
  return json;
}

std::string simulated_table(const SimulatedRecords& simulated) {
  std::vector<std::string> suffixes = {"_simulated"};
  std::vector<const Eigen::MatrixXd*> columns = {&simulated.outputs};
  if (simulated.level > 0.0) {
    suffixes.insert(suffixes.end(), {"_low", "_high"});
    columns.insert(columns.end(), {&simulated.band.lower, &simulated.band.upper});
  }
  std::string text;
  for (const Signal& output : simulated.model.parts().outputs) {
    for (const std::string& suffix : suffixes) text += (text.empty() ? "" : ",") + csv_field(output.name + suffix);
  }
  text += "\n";
  for (Eigen::Index row = 0; row < simulated.outputs.rows(); ++row) {
    for (Eigen::Index o = 0; o < simulated.outputs.cols(); ++o) {
      for (const Eigen::MatrixXd* column : columns) {
        const double value = (*column)(row, o);
        if (o > 0 || column != columns.front()) text += ",";
        if (std::isfinite(value)) text += fmt::format("{}", value);
      }
    }
    text += "\n";
  }
  return text;
}

}  // namespace llmt::report
