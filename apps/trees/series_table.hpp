/// \file
/// Tables as records of a system that moves.
#pragma once

#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/dynamic_model.hpp"
#include "llmt/series.hpp"

namespace llmt::apps {

/// Which columns of a table are what.
struct SeriesColumns {
  std::vector<std::string> inputs;
  std::vector<std::string> outputs;
  std::string time;    ///< empty: there is none
  std::string groups;  ///< the record of each row; empty: one record
  double grid = 0.0;   ///< sample time to interpolate to; 0: the rows are at equal steps
  int threads = 0;
};

struct SeriesTable {
  Series series;
  std::vector<Eigen::Index> lines;  ///< of the rows; empty after interpolation
};

/// Reads a series. A column that is not there, as an output in a table of inputs to simulate, is missing throughout if
/// `may_lack_outputs`. Throws std::runtime_error and std::invalid_argument that name file, line, column or option.
SeriesTable read_series(const Csv& csv, const SeriesColumns& columns, bool may_lack_outputs = false);

}  // namespace llmt::apps
