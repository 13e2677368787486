#include "report/signals/signals_summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <stdexcept>

namespace llmt::report {
namespace {

std::string with_unit(double seconds) {
  return seconds < 1.0 ? fmt::format("{} ms", number(1000.0 * seconds, 3)) : fmt::format("{} s", number(seconds, 4));
}

std::string counted(Eigen::Index count, const char* one, const char* several) {
  return fmt::format("{} {}", count, count == 1 ? one : several);
}

Eigen::Index rows_of_table(const SignalsSummary& summary) { return summary.signals.time.size(); }

std::string sentence_of_standstill(const SignalsSummary& summary) {
  const discovery::Signals& signals = summary.signals;
  std::vector<std::string> speeds;
  std::vector<std::string> still;
  for (std::size_t j = 0; j < signals.standstill.size(); ++j) {
    const std::string& name = summary.columns.positions[j];
    if (!signals.moves[j]) {
      still.push_back(name);
    } else {
      speeds.push_back(fmt::format("|d{}| < {}", name, number(signals.standstill[j], 3)));
    }
  }
  std::string text;
  if (!speeds.empty()) {
    text = fmt::format(
        "Standstill: {} left out, where {}{}.", counted(signals.standing, "row", "rows"), fmt::join(speeds, " or "),
        signals.lobe > 0.0 ? fmt::format(", or where one of them reverses within {}", with_unit(signals.lobe)) : "");
  }
  if (!still.empty()) {
    text += fmt::format("{}{} never {}: no row is left out for {}.", text.empty() ? "" : " ", fmt::join(still, ", "),
                        still.size() == 1 ? "moves" : "move", still.size() == 1 ? "it" : "them");
  }
  return text;
}

std::string table_of_noise(const SignalsSummary& summary, std::size_t width) {
  const discovery::Signals& signals = summary.signals;
  Table table({"column", "noise in the log", "in the table", "of its velocity", "of its acceleration"});
  const auto add = [&](const std::string& name, const discovery::ColumnNoise& noise, bool differentiated) {
    table.add({name, number(noise.in_log, 3), number(noise.in_table, 3),
               differentiated ? number(noise.of_velocity, 3) : "",
               differentiated ? number(noise.of_acceleration, 3) : ""});
  };
  for (std::size_t j = 0; j < signals.position_noise.size(); ++j) {
    add(summary.columns.positions[j], signals.position_noise[j], true);
  }
  for (std::size_t j = 0; j < signals.torque_noise.size(); ++j) {
    add(summary.columns.torques[j], signals.torque_noise[j], false);
  }
  return table.text(width);
}

}  // namespace

std::vector<std::string> signal_names(const LogColumns& columns, bool dense) {
  std::vector<std::string> names;
  std::map<std::string, std::string> origins;
  const auto add = [&](const std::string& name, const std::string& origin) {
    const auto [entry, is_new] = origins.emplace(name, origin);
    if (!is_new) {
      throw std::invalid_argument(
          fmt::format("two columns of the table would be called \"{}\": {}, and {}", name, entry->second, origin));
    }
    names.push_back(name);
  };
  if (!columns.group.empty()) add(columns.group, "the group");
  add(columns.time, "the time");
  for (const std::string& name : columns.positions) add(name, "a position");
  for (const std::string& name : columns.positions) add("d" + name, fmt::format("the velocity of \"{}\"", name));
  for (const std::string& name : columns.positions) add("dd" + name, fmt::format("the acceleration of \"{}\"", name));
  for (const std::string& name : columns.torques) add(name, "a torque");
  for (const std::string& name : columns.kept) add(name, "a column to keep");
  for (const char* derivative : {"", "d", "dd"}) {
    for (const std::string& name : columns.positions) {
      add(noise_column(derivative + name), fmt::format("the noise of \"{}{}\"", derivative, name));
    }
  }
  for (const std::string& name : columns.torques) add(noise_column(name), fmt::format("the noise of \"{}\"", name));
  if (dense) add(cutoff_column, "the cutoff of the filter");
  return names;
}

Eigen::MatrixXd signal_values(const discovery::Signals& signals) {
  const Eigen::Index p = signals.positions.cols();
  Eigen::MatrixXd values(signals.time.size(), 1 + 3 * p + signals.torques.cols());
  values << signals.time, signals.positions, signals.velocities, signals.accelerations, signals.torques;
  return values;
}

Eigen::VectorXd signal_constants(const SignalsSummary& summary) {
  const discovery::Signals& signals = summary.signals;
  const auto p = std::ssize(signals.position_noise);
  const auto k = std::ssize(signals.torque_noise);
  Eigen::VectorXd noise(3 * p + k + (signals.dense ? 1 : 0));
  if (signals.dense) noise(3 * p + k) = summary.cutoff;
  for (Eigen::Index j = 0; j < p; ++j) {
    noise(j) = signals.position_noise[j].in_table;
    noise(p + j) = signals.position_noise[j].of_velocity;
    noise(2 * p + j) = signals.position_noise[j].of_acceleration;
  }
  for (Eigen::Index j = 0; j < k; ++j) noise(3 * p + j) = signals.torque_noise[j].in_table;
  return noise;
}

std::string signals_text(const SignalsSummary& summary, std::size_t width) {
  const discovery::Signals& signals = summary.signals;
  std::vector<std::string> lines;
  std::size_t used = 0;
  std::vector<std::string> unused;
  for (std::size_t k = 0; k < signals.stretches.size(); ++k) {
    const discovery::Stretch& stretch = signals.stretches[k];
    if (stretch.kept > 0) {
      ++used;
    } else {
      unused.push_back(fmt::format("{}-{}", summary.firsts[k], summary.lasts[k]));
    }
  }
  lines.push_back(fmt::format(
      "{} rows of {}{} from {} samples of {} at {} Hz, {}.", rows_of_table(summary),
      fmt::join(summary.columns.positions, ", "),
      summary.columns.torques.empty() ? "" : fmt::format(" and {}", fmt::join(summary.columns.torques, ", ")),
      summary.rows, summary.log, number(1.0 / signals.step),
      used == 1 ? "one run without a gap" : fmt::format("{} runs without a gap", used)));
  if (signals.resampled) lines.push_back("Times are unequally spaced: the signals were interpolated at even steps.");
  lines.push_back(
      fmt::format("Filter: low pass of {} Hz without delay, the same for all columns; velocities and "
                  "accelerations are derivatives through it.",
                  number(summary.cutoff)));
  lines.push_back(fmt::format("Ends: {} cut at both ends of a run.", with_unit(signals.half_length)));
  if (!unused.empty()) {
    lines.push_back(fmt::format("Left out: {} {}, shorter than the filter or at standstill throughout.",
                                summary.counted + "s", first_names(unused)));
  }
  lines.push_back(
      fmt::format("Rows: {} apart, one of {}; white noise of the log correlates by {} between neighbours.{}",
                  with_unit(static_cast<double>(signals.every) * signals.step),
                  counted(signals.every, "sample", "samples"), number(signals.correlation, 2),
                  signals.dense ? " `llmt discover` filters the simulation at these rows in the same way." : ""));
  const std::string standstill = signals.dense ? "" : sentence_of_standstill(summary);
  if (!standstill.empty()) lines.push_back(standstill);
  if (!summary.table.empty()) lines.push_back(fmt::format("Written to {}.", summary.table));
  std::string text;
  for (const std::string& line : lines) text += wrapped(line, width, 2) + "\n";
  text += "\n" +
          wrapped("Noise, as standard deviations, estimated from frequencies of four times the cutoff and more:", width,
                  2) +
          "\n" + table_of_noise(summary, width);
  return text;
}

Json signals_json(const SignalsSummary& summary) {
  const discovery::Signals& signals = summary.signals;
  Json json;
  json["log"] = summary.log;
  if (!summary.table.empty()) json["table"] = summary.table;
  json["samples"] = summary.rows;
  json["rows"] = rows_of_table(summary);
  json["rate_hz"] = 1.0 / signals.step;
  json["resampled"] = signals.resampled;
  json["cutoff_hz"] = summary.cutoff;
  json["cut_at_ends_s"] = signals.half_length;
  json["samples_at_ends"] = signals.ends_cut;
  json["every"] = signals.every;
  json["step_s"] = static_cast<double>(signals.every) * signals.step;
  json["neighbour_correlation"] = signals.correlation;
  json["dense"] = signals.dense;
  json["standstill_rows"] = signals.standing;
  json["reversal_s"] = signals.lobe;
  Json standstill = Json::object();
  for (std::size_t j = 0; j < signals.standstill.size(); ++j) {
    standstill[summary.columns.positions[j]] = signals.moves[j] ? Json(signals.standstill[j]) : Json(nullptr);
  }
  json["standstill"] = standstill;
  json["runs"] = Json::array();
  for (std::size_t k = 0; k < signals.stretches.size(); ++k) {
    const discovery::Stretch& stretch = signals.stretches[k];
    Json run;
    if (!summary.columns.group.empty()) run["run"] = stretch.run;
    run["first_" + summary.counted] = summary.firsts[k];
    run["last_" + summary.counted] = summary.lasts[k];
    run["rows"] = stretch.kept;
    json["runs"].push_back(run);
  }
  json["columns"] = signal_names(summary.columns, signals.dense);
  Json noise = Json::object();
  Json noise_in_log = Json::object();
  for (std::size_t j = 0; j < signals.position_noise.size(); ++j) {
    const std::string& name = summary.columns.positions[j];
    noise_in_log[name] = signals.position_noise[j].in_log;
    noise[name] = signals.position_noise[j].in_table;
    noise["d" + name] = signals.position_noise[j].of_velocity;
    noise["dd" + name] = signals.position_noise[j].of_acceleration;
  }
  for (std::size_t j = 0; j < signals.torque_noise.size(); ++j) {
    noise_in_log[summary.columns.torques[j]] = signals.torque_noise[j].in_log;
    noise[summary.columns.torques[j]] = signals.torque_noise[j].in_table;
  }
  json["noise_in_log"] = noise_in_log;
  json["noise"] = noise;
  return json;
}

}  // namespace llmt::report
