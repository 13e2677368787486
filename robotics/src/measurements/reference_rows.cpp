#include "measurements/reference_rows.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "llmt/robotics/orientation.hpp"
#include "measurements/drift.hpp"

namespace llmt::robotics {
namespace {

constexpr double most_chance = 0.01;  // of a movement that is none

// Name of the column of reference points in the file; empty if there is none.
std::string reference_column(const Csv& csv, const ColumnMap& map) {
  for (const std::string& column : csv.columns()) {
    const auto mapped = map.names.find(column);
    if ((mapped == map.names.end() ? column : mapped->second) == "reference") return column;
  }
  return {};
}

// Place of each row in the sequence of readings: `order`, or else time_s, or else the row itself.
std::vector<double> sequence_of(const Csv& csv, const Header& header) {
  const std::string column = header.sequence_column();
  std::vector<double> when(csv.rows());
  if (column.empty()) {
    std::iota(when.begin(), when.end(), 0.0);
  } else {
    const Eigen::VectorXd values = csv.numbers(column);
    when.assign(values.begin(), values.end());
  }
  return when;
}

std::vector<ReferenceReading> readings_of(const Csv& csv, const Csv& part, const ReferenceRows& split,
                                          const std::vector<double>& when, const Robot& robot, const ColumnMap& map) {
  const Header header(part, robot, {}, map);
  if (header.targets().empty())
    csv.refuse(split.references.front(), reference_column(csv, map), "the row has no point");
  std::array<bool, 3> measured = {};
  const Eigen::MatrixXd points = header.points_mm(header.targets().front(), measured);
  if (!std::ranges::all_of(measured, [](bool seen) { return seen; })) {
    throw std::runtime_error(fmt::format("{}:1: reference points need x, y and z", csv.name()));
  }
  const std::vector<std::string> names = header.words("reference");
  std::vector<ReferenceReading> readings;
  for (std::size_t k = 0; k < split.references.size(); ++k) {
    const Eigen::Index row = split.references[k];
    const Eigen::Vector3d point = points.row(static_cast<Eigen::Index>(k)).transpose();
    if (point.hasNaN()) csv.refuse(row, reference_column(csv, map), "a coordinate of the reference point is missing");
    readings.push_back({.point = names[k], .when = when[row], .position_mm = point, .line = csv.line_of(row)});
  }
  return readings;
}

// Readings with no measured row between them are a round.
std::vector<std::vector<ReferenceReading>> rounds_of(std::vector<ReferenceReading> readings,
                                                     std::vector<double> measured_when) {
  std::ranges::stable_sort(readings, {}, &ReferenceReading::when);
  std::ranges::sort(measured_when);
  std::vector<std::vector<ReferenceReading>> rounds;
  for (const ReferenceReading& reading : readings) {
    const bool goes_on = !rounds.empty() && std::ranges::upper_bound(measured_when, rounds.back().back().when) ==
                                                std::ranges::upper_bound(measured_when, reading.when);
    if (!goes_on) rounds.emplace_back();
    rounds.back().push_back(reading);
  }
  return rounds;
}

void refuse_strange_round(const Csv& csv, const std::vector<std::vector<ReferenceReading>>& rounds) {
  for (const std::vector<ReferenceReading>& round : rounds) {
    const bool shares = std::ranges::any_of(round, [&](const ReferenceReading& reading) {
      return std::ranges::find(rounds.front(), reading.point, &ReferenceReading::point) != rounds.front().end();
    });
    if (shares) continue;
    throw std::runtime_error(fmt::format("{}:{}: reference point \"{}\": this round has no point of the first round",
                                         csv.name(), round.front().line, round.front().point));
  }
}

struct Session {
  std::string name;
  std::vector<ReferenceReading> readings = {};
  std::vector<Eigen::Index> measured = {};  // rows of the measurements
  std::vector<double> when = {};            // of those
};

std::vector<Session> sessions_of(const Csv& csv, const Header& header, const std::vector<ReferenceReading>& readings,
                                 const ReferenceRows& split, const std::vector<double>& when,
                                 const std::vector<Eigen::Index>& rows) {
  const std::vector<std::string> names = header.words("session");
  const auto name_of = [&](Eigen::Index row) { return names.empty() ? std::string() : names[row]; };
  std::vector<Session> sessions;
  const auto session = [&](Eigen::Index row) -> Session& {
    const auto found = std::ranges::find(sessions, name_of(row), &Session::name);
    if (found != sessions.end()) return *found;
    return sessions.emplace_back(Session{.name = name_of(row)});
  };
  for (std::size_t k = 0; k < rows.size(); ++k) {
    Session& own = session(rows[k]);
    own.measured.push_back(static_cast<Eigen::Index>(k));
    own.when.push_back(when[rows[k]]);
  }
  for (std::size_t k = 0; k < split.references.size(); ++k) {
    const Eigen::Index row = split.references[k];
    if (name_of(row).empty() && !names.empty()) csv.refuse(row, "session", "the name is missing");
    session(row).readings.push_back(readings[k]);
  }
  return sessions;
}

// Moves the rows of a session into the frame of its first round; returns the greatest step, mm.
double move_back(const Session& session, const Drift& drift, std::vector<Eigen::Matrix3d>& rotations,
                 Measurements& measurements) {
  double greatest = 0.0;
  for (std::size_t k = 0; k < session.measured.size(); ++k) {
    const Eigen::Index row = session.measured[k];
    const std::vector<Observation>& observations = measurements.poses.observations;
    if (!observations.empty() && is_socket(observations[row].base)) continue;  // the instrument did not see it
    const Pose back = drift.to_first_round(session.when[k]);
    const Eigen::Vector3d before = measurements.positions_mm.row(row).transpose();
    const Eigen::Vector3d after = back.rotation * before + back.position_mm;
    greatest = std::max(greatest, (after - before).norm());
    measurements.positions_mm.row(row) = after.transpose();
    if (!rotations.empty()) rotations[row] = back.rotation * rotations[row];
  }
  return greatest;
}

std::string words_of_rows(const std::vector<ReferenceReading>& readings, const Face& face) {
  std::string text;
  for (const ReferenceReading& reading : readings) {
    text += fmt::format("{}{} (\"{}\")", text.empty() ? "" : ", ", face.rows({reading.line}), reading.point);
  }
  return text;
}

}  // namespace

ReferenceRows reference_rows(const Csv& csv, const ColumnMap& map) {
  ReferenceRows split;
  const std::string column = reference_column(csv, map);
  const std::vector<std::string> names = column.empty() ? std::vector<std::string>{} : csv.texts(column);
  for (Eigen::Index row = 0; row < csv.rows(); ++row) {
    (names.empty() || names[row].empty() ? split.others : split.references).push_back(row);
  }
  return split;
}

void take_off_drift(const Csv& csv, const ReferenceRows& split, const Robot& robot, const ColumnMap& map,
                    const std::vector<Eigen::Index>& rows, Measurements& measurements) {
  if (split.references.empty()) return;
  const bool is_point = std::ranges::all_of(measurements.measured, [](bool seen) { return seen; });
  if (!is_point) {
    throw std::runtime_error(
        fmt::format("{}:1: reference points move measured points back: these need x, y and z, too", csv.name()));
  }
  const Csv part = csv.with_rows(split.references);
  const Header header(csv, robot, {}, map);
  const std::vector<double> when = sequence_of(csv, header);
  const std::vector<ReferenceReading> readings = readings_of(csv, part, split, when, robot, map);

  Orientation& orientation = measurements.orientation;
  const std::string convention = orientation.convention.empty() ? robot.chain.orientation : orientation.convention;
  const bool is_angle = orientation.kind == Orientation::Kind::angles_deg;
  // Angles of no convention cannot be used later, either.
  const bool has_rotations = orientation.values.size() != 0 && (!is_angle || is_orientation(convention));
  std::vector<Eigen::Matrix3d> rotations =
      has_rotations ? rotations_of(orientation, convention) : std::vector<Eigen::Matrix3d>{};

  for (const Session& session : sessions_of(csv, header, readings, split, when, rows)) {
    const std::string of = session.name.empty() ? "" : fmt::format("session \"{}\": ", session.name);
    const auto say = [&](const char* code, const std::string& text, const std::vector<ReferenceReading>& about = {}) {
      Finding said = {code, [name = csv.name(), of, text, about](const Face& face) {
                        return fmt::format("{}: {}{}{}", face.table(name), of, text, words_of_rows(about, face));
                      }};
      for (const ReferenceReading& reading : about) said.lines.push_back(reading.line);
      measurements.warnings.push_back(std::move(said));
    };
    if (session.readings.empty()) {
      say("no_reference", "there is no reading of a reference point: drift is not taken off");
      continue;
    }
    if (session.measured.empty()) continue;
    const auto rounds = rounds_of(session.readings, session.when);
    refuse_strange_round(csv, rounds);
    if (rounds.size() < 2) {
      say("one_round",
          "the reference points were read in one round only, which shows no drift: read them again at the end");
      continue;
    }
    const Drift drift(rounds);
    const std::string scatter =
        drift.scatter_mm() ? fmt::format("they scatter by {:.3g} mm", *drift.scatter_mm()) : "their scatter is unknown";
    if (!drift.strays().empty()) {
      say("reference_strays", "reference points far from where the others say, moved or mistaken: ", drift.strays());
    }
    if (drift.p_value() > most_chance) {
      say("no_drift",
          fmt::format("reference points in {} rounds show no drift of the instrument ({}): nothing is taken off",
                      rounds.size(), scatter));
      continue;
    }
    const double greatest = move_back(session, drift, rotations, measurements);
    say("moved_back",
        fmt::format("drift of the instrument by reference points in {} rounds is taken off: up to {:.3g} mm ({}{})",
                    rounds.size(), greatest, scatter,
                    drift.turns() ? "" : "; three points that are not on a line would show rotations, too"));
  }
  if (!has_rotations) return;
  orientation.values = to_orientation(rotations, is_angle ? convention : "").values;
}

}  // namespace llmt::robotics
