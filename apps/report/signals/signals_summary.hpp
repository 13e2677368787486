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

/// Names of the columns of the table, in its order: the group, time, positions, velocities (d + position),
/// accelerations (dd + position), torques, and what is kept. Throws std::invalid_argument for a name that comes twice,
/// saying which column it is made from.
std::vector<std::string> signal_names(const LogColumns& columns);

/// The columns with numbers, without group and kept ones.
Eigen::MatrixXd signal_values(const discovery::Signals& signals);

std::string signals_text(const SignalsSummary& summary, std::size_t width = no_width_limit);
Json signals_json(const SignalsSummary& summary);

}  // namespace llmt::report
