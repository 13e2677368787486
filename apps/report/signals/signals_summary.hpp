/// \file
/// The table that signals() makes of a log: its columns by name, and what was done, as text and as JSON.
#pragma once

#include <string>
#include <vector>

#include "llmt/discovery/signals.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// Which column of a log is what.
struct LogColumns {
  std::string time;  ///< of the table too
  std::vector<std::string> positions;
  std::vector<std::string> torques;
  std::string group;              ///< empty: none
  std::vector<std::string> kept;  ///< taken over as they stand
};

struct SignalsSummary {
  std::string log;    ///< name of the table
  std::string table;  ///< the file that was written; may be empty
  LogColumns columns;
  double cutoff = 0.0;  ///< in Hz
  Eigen::Index rows = 0;
  std::string counted = "line";      ///< what `firsts` and `lasts` are: lines of a file, or rows of a table
  std::vector<Eigen::Index> firsts;  ///< of each stretch: where it begins, and where it ends
  std::vector<Eigen::Index> lasts;
  discovery::Signals signals;
};

/// The column that says the noise of another one.
inline std::string noise_column(const std::string& name) { return "noise_" + name; }

/// The column that says the cutoff of the filter, of rows that are dense enough to filter a simulation alike.
inline constexpr const char* cutoff_column = "cutoff_hz";

/// Names of the columns of the table, in its order: the group, time, positions, velocities (d + position),
/// accelerations (dd + position), torques, what is kept, and, the same in all rows, the noise of each ("noise_" + its
/// name) and, with `dense`, the cutoff. Throws std::invalid_argument for a name that comes twice, saying which column
/// it is made from.
std::vector<std::string> signal_names(const LogColumns& columns, bool dense);

/// The columns with numbers, without group, kept ones and noise.
Eigen::MatrixXd signal_values(const discovery::Signals& signals);

/// What is the same in all rows: standard deviations of the noise of positions, velocities, accelerations and torques
/// of the table, in this order, and the cutoff of dense rows.
Eigen::VectorXd signal_constants(const SignalsSummary& summary);

std::string signals_text(const SignalsSummary& summary, std::size_t width = no_width_limit);
Json signals_json(const SignalsSummary& summary);

}  // namespace llmt::report
